"""Writes LSF logs: consecutive packets, in independent members."""

import os
from collections import deque
from collections.abc import Callable
from pathlib import Path

from imc.lsf.gzip_members import COMPRESSIONS

BLOCK = 1 << 17  # unpacked bytes of one member, as in DUNE


class LsfWriter:
    """Writes packets to a new LSF file; `compression` is "none", "gzip", "zlib" or "bzip2".

    Packets are collected until there are `block` bytes or `flush()` is called; then one write appends them as a
    complete member, so that the file can be read at any time. If the disk is full, or there is no file until `open`,
    members are kept in memory (`waiting` is their size in bytes, packed) and written first next time; no partial member
    stays in the file. Raises OSError, FileExistsError.
    """

    def __init__(self, path: str | os.PathLike[str] | None, compression: str = "gzip", block: int = BLOCK):
        self.size: int = 0
        self.waiting: int = 0
        self._pack: Callable[[bytes], bytes] = COMPRESSIONS[compression].pack if compression != "none" else bytes
        self._block = block
        self._packets = bytearray()
        self._members: deque[bytes] = deque()
        self._file = -1
        if path is not None:
            self.open(path)

    def open(self, path: str | os.PathLike[str]) -> None:
        """Make the file of a writer that has none yet."""
        self.path: Path = Path(path)
        self._file = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o644)

    def write(self, packet: bytes) -> None:
        """Take one packet. Raises OSError if a full block cannot be written; the packet is kept even then."""
        self._packets += packet
        if len(self._packets) >= self._block:
            self.flush()

    def flush(self) -> None:
        """Hand all packets to the operating system, so that they survive the end of this process."""
        if self._packets:
            member = self._pack(bytes(self._packets))
            self._packets.clear()
            self._members.append(member)
            self.waiting += len(member)
        while self._members and self._file >= 0:
            self._append(self._members[0])
            self.waiting -= len(self._members.popleft())

    def fileno(self) -> int:
        return self._file

    def is_file_in_place(self) -> bool:
        """Whether the path still leads to the open file."""
        try:
            return os.path.samestat(os.stat(self.path), os.fstat(self._file))
        except OSError:
            return False

    def adopt_pending(self, other: "LsfWriter") -> None:
        """Take over what `other`, which is closed, has not written."""
        other.flush()
        self._members += other._members
        self.waiting += other.waiting
        other._members.clear()
        other.waiting = 0

    def close(self) -> None:
        """Flush and close; the file is closed even if the flush raises."""
        try:
            self.flush()
        finally:
            self.close_without_flush()

    def close_without_flush(self) -> None:
        """Close the file without a flush; what waits stays in memory."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1

    def _append(self, member: bytes) -> None:
        if os.fstat(self._file).st_size != self.size:
            os.ftruncate(self._file, self.size)
        rest = memoryview(member)
        try:
            # A full disk first takes a part; only the next write raises.
            while rest:
                rest = rest[os.write(self._file, rest) :]
        except OSError as error:
            os.ftruncate(self._file, self.size)
            raise OSError(error.errno, error.strerror, str(self.path)) from error
        self.size += len(member)
