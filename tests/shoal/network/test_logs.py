"""What a server of logs may say."""

from ftplib import FTP
from typing import Any

from shoal.network.logs import names_in


class Hostile(FTP):
    """Names that lead elsewhere, or are none."""

    def mlsd(self, path: str = "", facts: Any = ()) -> Any:
        for name in ("..", ".", "/etc/passwd", "..\\x", "a/../../b", "", "a\0b", "x" * 300, "20260101"):
            yield name, {"type": "dir"}
        yield "20260102", {"type": "file", "size": "-3"}
        yield "20260103", {"type": "file", "size": "12"}


def test_no_name_leads_out_of_the_folder() -> None:
    assert names_in(Hostile(), "", "dir") == {"20260101": 0}
    assert names_in(Hostile(), "", "file") == {"20260102": 0, "20260103": 12}
