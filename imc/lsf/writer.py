"""Writes LSF logs: packets one behind the other, in members that are complete in themselves."""

import os
from collections import deque
from collections.abc import Callable
from pathlib import Path

from imc.lsf.members import COMPRESSIONS

BLOCK = 1 << 17  # DUNE's, too: unpacked bytes of one member


class LsfWriter:
    """Writes packets to a new LSF file; `compression` is "none", "gzip", "zlib" or "bzip2".

    Packets wait until `block` bytes are together or `flush()` is called, and then go to the file as one complete
    member with one write, so that the file can be read at any time. What a full disk refuses stays in `waiting`
    (bytes, packed) and is tried again first; nothing half-written is left. Raises OSError, FileExistsError.
    """

    def __init__(self, path: str | os.PathLike[str], compression: str = "gzip", block: int = BLOCK):
        self.path = Path(path)
        self.size = 0
        self.waiting = 0
        self._pack: Callable[[bytes], bytes] = COMPRESSIONS[compression].pack if compression != "none" else bytes
        self._block = block
        self._packets = bytearray()
        self._members: deque[bytes] = deque()
        self._file = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o644)

    def write(self, packet: bytes) -> None:
        """Take one packet. Raises OSError where a full block cannot be written; the packet is kept all the same."""
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
        while self._members:
            self._append(self._members[0])
            self.waiting -= len(self._members.popleft())

    def fileno(self) -> int:
        return self._file

    def in_place(self) -> bool:
        """Whether the path still leads to the file that is written."""
        try:
            return os.path.samestat(os.stat(self.path), os.fstat(self._file))
        except OSError:
            return False

    def close(self) -> None:
        """Flush and close; it is closed even where the flush raises."""
        try:
            self.flush()
        finally:
            os.close(self._file)

    def _append(self, member: bytes) -> None:
        if os.fstat(self._file).st_size != self.size:
            os.ftruncate(self._file, self.size)
        rest = memoryview(member)
        try:
            # A full disk takes a part of it first, and says what is wrong when asked for the rest.
            while rest:
                rest = rest[os.write(self._file, rest) :]
        except OSError as error:
            os.ftruncate(self._file, self.size)
            raise OSError(error.errno, error.strerror, str(self.path)) from error
        self.size += len(member)
