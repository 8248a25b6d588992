"""Files whose reader never waits."""

import os
import socket
from pathlib import Path

import pytest

from support.regular_files import check_regular_file, read_regular_file


def test_a_file_and_a_link_to_it_are_read(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"content")
    (tmp_path / "link").symlink_to(tmp_path / "file")
    assert [read_regular_file(tmp_path / name) for name in ("file", "link")] == [b"content"] * 2


@pytest.mark.parametrize("kind", ["pipe", "socket", "folder", "device", "link to a pipe"])
def test_what_is_no_file_is_rejected_at_once(tmp_path: Path, kind: str) -> None:
    path, pipe = tmp_path / "name", tmp_path / "pipe"
    os.mkfifo(pipe)
    with socket.socket(socket.AF_UNIX) as listener:
        match kind:
            case "pipe":
                path = pipe
            case "socket":
                listener.bind(str(path))
            case "folder":
                path.mkdir()
            case "device":
                path = Path("/dev/zero")
            case _:
                path.symlink_to(pipe)
        for use in (check_regular_file, read_regular_file):
            with pytest.raises(OSError, match="not a regular file") as caught:
                use(path)
            assert caught.value.filename == str(path)


def test_a_pipe_that_takes_the_place_of_a_file_is_not_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    os.mkfifo(tmp_path / "pipe")
    monkeypatch.setattr("support.regular_files.check_regular_file", lambda _: None)
    with pytest.raises(OSError, match="not a regular file"):
        read_regular_file(tmp_path / "pipe")
