"""Requests and answers of MAVLink's file transfer protocol (mavlink.io/en/services/ftp.html)."""

import errno
import struct
from dataclasses import dataclass
from enum import IntEnum
from zlib import crc32

from mavlink.vehicle.interfaces import FileEntry

LAYOUT = struct.Struct("<HBBBBBxI")
PAYLOAD = 251
MOST_DATA = PAYLOAD - LAYOUT.size  # 239
ACK, NAK = 128, 129


class FtpOpcode(IntEnum):
    """Requests."""

    NONE = 0
    TERMINATE = 1
    RESET = 2
    LIST = 3
    OPEN = 4
    READ = 5
    CREATE = 6
    WRITE = 7
    REMOVE = 8
    CREATE_FOLDER = 9
    REMOVE_FOLDER = 10
    OPEN_TO_WRITE = 11
    TRUNCATE = 12
    RENAME = 13
    CHECKSUM = 14
    BURST = 15
    LIST_WITH_TIME = 16


class FtpErrorCode(IntEnum):
    """Reason why a request is rejected."""

    ERRNO = 2
    DATA_SIZE = 3
    SESSION = 4
    NO_SESSIONS = 5
    END = 6
    UNKNOWN = 7
    PROTECTED = 9
    NOT_FOUND = 10


WRITING = frozenset(range(FtpOpcode.CREATE, FtpOpcode.RENAME + 1))
NOT_FOUND = (errno.ENOENT, errno.ENOTDIR, errno.EISDIR, errno.ELOOP, errno.ENAMETOOLONG)


class FtpError(Exception):
    """A request that is rejected; `number` is that of the operating system, for ERRNO."""

    def __init__(self, reason: FtpErrorCode, number: int = 0):
        super().__init__(reason.name)
        self.reason: FtpErrorCode = reason
        self.number: int = number

    @classmethod
    def of(cls, error: OSError) -> "FtpError":
        number = error.errno or errno.EIO
        return cls(FtpErrorCode.NOT_FOUND) if number in NOT_FOUND else cls(FtpErrorCode.ERRNO, number)


@dataclass(frozen=True, slots=True)
class FtpRequest:
    """A request; `raw` is its whole payload."""

    raw: bytes
    sequence: int
    session: int
    opcode: int
    size: int
    offset: int

    @classmethod
    def parse(cls, payload: bytes) -> "FtpRequest | None":
        """The request in a payload of FILE_TRANSFER_PROTOCOL, whose zeros at the end may be missing; None if it is an
        answer."""
        raw = payload[:PAYLOAD].ljust(PAYLOAD, b"\0")
        sequence, session, opcode, size, _, _, offset = LAYOUT.unpack_from(raw)
        return None if opcode in (ACK, NAK) else cls(raw, sequence, session, opcode, size, offset)

    @property
    def data(self) -> bytes:
        return self.raw[LAYOUT.size : LAYOUT.size + self.size]

    @property
    def count(self) -> int:
        """Number of bytes to read."""
        return self.size if 0 < self.size <= MOST_DATA else MOST_DATA

    def answer(self, data: bytes = b"", *, step: int = 1, offset: int | None = None, complete: bool = False) -> bytes:
        """The payload of the answer; that of a burst has a `step` for each packet, its offset, and is `complete`."""
        return self._reply(ACK, data, step, self.offset if offset is None else offset, complete)

    def refuse(self, refusal: FtpError, *, step: int = 1, offset: int | None = None) -> bytes:
        data = bytes((refusal.reason, refusal.number & 0xFF)) if refusal.number else bytes((refusal.reason,))
        return self._reply(NAK, data, step, self.offset if offset is None else offset, self.opcode == FtpOpcode.BURST)

    def _reply(self, kind: int, data: bytes, step: int, offset: int, complete: bool) -> bytes:
        sequence = (self.sequence + step) & 0xFFFF
        return LAYOUT.pack(sequence, self.session, kind, len(data), self.opcode, complete, offset) + data


def checksum(data: bytes, value: int = 0) -> int:
    """MAVLink's CRC-32: zlib's polynomial, but begun with 0 and not inverted. `value` is that of the data before."""
    return crc32(data, value ^ 0xFFFFFFFF) ^ 0xFFFFFFFF


def format_entry(entry: FileEntry | None, with_time: bool) -> bytes:
    """An entry as it is listed. One that is gone, or has a name that would spoil the listing, only keeps its place:
    QGroundControl drops the whole listing if a name is not UTF-8, and fields end at a tab."""
    skipped = b"S\0"
    if entry is None or b"\t" in entry.name:
        return skipped
    try:
        entry.name.decode()
    except UnicodeDecodeError:
        return skipped
    kind = b"D" if entry.is_folder else b"F"
    fields = [kind + entry.name]
    if with_time or not entry.is_folder:
        fields.append(b"%d" % entry.size)
    if with_time:
        fields.append(b"%d" % entry.changed)
    line = b"\t".join(fields) + b"\0"
    return line if len(line) <= MOST_DATA else skipped
