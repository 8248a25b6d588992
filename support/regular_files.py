"""Files whose reader never waits: no pipe, device or socket, whatever their name is."""

import errno
import os
import stat
from pathlib import Path
from typing import BinaryIO


def check_regular_file(path: Path) -> None:
    """Raise OSError, which names the path, for what is no regular file; a link to one is one."""
    _check(os.stat(path), path)


def open_regular_file(path: Path) -> BinaryIO:
    """A file that is open for reading. Raises OSError, also for what is no regular file."""
    check_regular_file(path)  # first: a device may act when it is opened
    place = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    try:
        _check(os.fstat(place), path)  # it may have been replaced
        return os.fdopen(place, "rb")
    except BaseException:
        os.close(place)
        raise


def read_regular_file(path: Path) -> bytes:
    """The content of a file. Raises OSError, also for what is no regular file."""
    with open_regular_file(path) as file:
        return file.read()


def _check(state: os.stat_result, path: Path) -> None:
    if not stat.S_ISREG(state.st_mode):
        raise OSError(errno.EINVAL, "not a regular file", str(path))
