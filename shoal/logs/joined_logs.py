"""The logs of a run as one log, and the newest log below a folder."""

import errno
import shutil
import tempfile
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path

from imc.lsf import SUFFIXES, find_log
from support.file_errors import add_path_to_errors

SAME = ("IMC.xml.gz", "IMC.xml")
JOINED = ("Output.txt",)
FIRST = ("Config.ini",)


@contextmanager
def joined_logs(logs: Sequence[Path]) -> Generator[Path]:
    """A temporary folder with consecutive logs as one, named after the first; a single log is taken as it is.

    Raises OSError, and ValueError if the logs have different definitions or compression.
    """
    if len(logs) == 1:
        yield logs[0]
        return
    parts = [find_log(log) for log in logs]
    if len({part.name for part in parts}) > 1:
        raise ValueError(f"the logs of the run differ in compression: {', '.join(map(str, parts))}")
    first = logs[0].resolve()
    with tempfile.TemporaryDirectory(prefix="shoal-") as place:
        whole = Path(place, first.parent.parent.name, first.parent.name, f"{first.name}-run")
        whole.mkdir(parents=True)
        for name in SAME:
            if len({_content(log / name) for log in logs}) > 1:
                raise ValueError(f"the logs of the run have different definitions: {', '.join(map(str, logs))}")
        with add_path_to_errors(place):
            for name in (*SAME, *FIRST):
                if (logs[0] / name).is_file():
                    shutil.copyfile(logs[0] / name, whole / name)
            # Packets follow each other without a header, and packed members do, too: files in a row are one log.
            for name in (parts[0].name, *JOINED):
                with (whole / name).open("wb") as joined:
                    for log in logs:
                        if (log / name).is_file():
                            with (log / name).open("rb") as part:
                                shutil.copyfileobj(part, joined, 1 << 20)
        yield whole


def newest_log(folder: Path) -> Path:
    """The folder of the log below `folder` that was written last. Raises FileNotFoundError."""
    found = [path for path in folder.rglob("Data.lsf*") if path.name.endswith(SUFFIXES) and path.is_file()]
    if not found:
        raise FileNotFoundError(errno.ENOENT, "there is no log below it", str(folder))
    return max(found, key=lambda path: (path.stat().st_mtime_ns, path)).parent


def _content(path: Path) -> bytes:
    return path.read_bytes() if path.is_file() else b""
