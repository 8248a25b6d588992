"""An append-only file of records: a crash loses the last one at most."""

import errno
import json
import os
import zlib
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, cast

Record = dict[str, Any]
_SYNC_BYTES = 1 << 20


class AppendLogInUse(ValueError):
    """Another process writes the journal."""


class AppendLog:
    """Adds records to a file, one JSON line each, with its CRC-32 before it.

    A line that is not whole is that of a process that was killed, or of a full disk: it is cut off when the journal
    is opened. Only one process may have it open. Raises AppendLogInUse, and OSError.
    """

    def __init__(self, path: Path):
        self._path = path
        self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | getattr(os, "O_CLOEXEC", 0), 0o644)
        try:
            _lock(self._file, path)
            self.records: list[Record]
            self.damaged_lines: int
            self.records, self.damaged_lines = read_append_log(path)
            self._end = _complete_length(path.read_bytes())
            os.ftruncate(self._file, self._end)
        except BaseException:
            os.close(self._file)
            raise
        self._unsynced = 0

    def __enter__(self) -> "AppendLog":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        self.close()

    def append(self, record: Mapping[str, Any]) -> None:
        """Append a record. If the disk is full, raises OSError, and the journal is as before."""
        text = json.dumps(record, separators=(",", ":")).encode()
        line = b"%08x %s\n" % (zlib.crc32(text), text)
        written = 0
        try:
            while written < len(line):
                written += os.write(self._file, line[written:])
        except OSError as error:
            os.ftruncate(self._file, self._end)
            raise OSError(error.errno, error.strerror, str(self._path)) from None
        self._end += len(line)
        self._unsynced += len(line)
        if self._unsynced > _SYNC_BYTES:  # a killed process loses nothing anyway; this is for a power failure
            self.sync()

    def sync(self) -> None:
        os.fsync(self._file)
        self._unsynced = 0

    def close(self) -> None:
        os.close(self._file)


def read_append_log(path: Path) -> tuple[list[Record], int]:
    """The records of a journal, also of one that is being written, and how many lines were damaged."""
    records: list[Record] = []
    damaged = 0
    for line in path.read_bytes().split(b"\n")[:-1]:
        record = _record(line)
        if record is None:
            damaged += 1
        else:
            records.append(record)
    return records, damaged


def _record(line: bytes) -> Record | None:
    check, _, text = line.partition(b" ")
    try:
        if int(check, 16) != zlib.crc32(text):
            return None
        found: object = json.loads(text)
    except ValueError:
        return None
    return cast(Record, found) if isinstance(found, dict) else None


def _complete_length(content: bytes) -> int:
    """The length of the whole lines."""
    return content.rfind(b"\n") + 1


def _lock(file: int, path: Path) -> None:
    try:
        import fcntl
    except ImportError:  # there is none on Windows
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno not in (errno.EAGAIN, errno.EACCES):
            raise
        raise AppendLogInUse(f"{path.parent}: another process is at work on this data set") from None
