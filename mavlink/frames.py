"""Frames of MAVLink 1 and 2, in datagrams and in streams of bytes."""

import re
import struct
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from fastcrc import crc16

from mavlink.dialect import Definition, Dialect

V1, V2 = 0xFE, 0xFD
MAGICS = (V1, V2)
SIGNED = 0x01
SIGNATURE = 13
LONGEST_DATAGRAM = 8192
LONGEST_HEADER = 10
LONGEST_FRAME = LONGEST_HEADER + 255 + 2 + SIGNATURE

_HEADER = struct.Struct("<xBBxBBBHB")  # length, flags, sequence, system, component, message id
_CHECKSUM = struct.Struct("<H")
_magic = re.compile(b"[\xfd\xfe]").search
_crc = crc16.mcrf4xx


class ReceivedMessage:
    """A received message.

    sequence: the sender's count. content: the payload as it came, without the zeros that were cut from its end.
    signature: link id, time and digest of a signed frame, else empty; signed: the bytes that the digest covers.
    """

    __slots__ = ("_values", "component", "content", "definition", "sequence", "signature", "signed", "system")

    def __init__(self, definition: Definition, system: int, component: int, sequence: int, content: bytes) -> None:
        self.definition: Definition = definition
        self.system: int = system
        self.component: int = component
        self.sequence: int = sequence
        self.content: bytes = content
        self.signature: bytes = b""
        self.signed: bytes = b""
        self._values: dict[str, Any] | None = None

    @property
    def name(self) -> str:
        return self.definition.name

    @property
    def payload(self) -> bytes:
        """The whole payload, with trailing zeros."""
        return self.definition.pad_payload(self.content)

    @property
    def values(self) -> dict[str, Any]:
        """The fields by name."""
        if self._values is None:
            self._values = self.definition.unpack(self.content)
        return self._values


def encode(
    definition: Definition,
    payload: bytes,
    sequence: int,
    system: int,
    component: int,
    sign: Callable[[bytes], bytes] | None = None,
) -> bytes:
    """A MAVLink 2 frame: zeros at the end of the payload are cut, but never its first byte.

    `sign` gives the signature of what it covers; see `Signing.signer`.
    """
    body = payload.rstrip(b"\0") or payload[:1]
    number, flags = definition.id, SIGNED if sign is not None else 0
    content = (
        bytes((len(body), flags, 0, sequence, system, component, number & 0xFF, number >> 8 & 0xFF, number >> 16))
        + body
    )
    frame = b"\xfd" + content + _CHECKSUM.pack(_crc(content + definition.salt))
    return frame + sign(frame) if sign is not None else frame


def split(datagram: bytes, dialect: Dialect) -> tuple[list[ReceivedMessage], int]:
    """The messages in a datagram, and the number of damaged stretches.

    No state is kept between datagrams, and a damaged frame does not hide a good one after it. Frames of messages that
    the dialect lacks are skipped. Signatures are not checked.
    """
    scan = _scan(datagram, dialect, whole=True)
    return scan.found, scan.damages


class StreamSplitter:
    """Finds the messages in a stream of bytes that comes in pieces, such as TCP or a serial line; see `split`.

    What looks like the beginning of a frame is kept until its end has come, at most LONGEST_FRAME bytes. `passed`
    counts the bytes before it.
    """

    def __init__(self, dialect: Dialect) -> None:
        self.passed: int = 0
        self._dialect = dialect
        self._kept = b""
        self._damaged = False

    @property
    def bytes_waiting(self) -> int:
        """Number of bytes that are kept."""
        return len(self._kept)

    def feed(self, data: bytes) -> tuple[list[ReceivedMessage], int]:
        """The messages that are complete, and the number of damaged stretches that have begun."""
        data = self._kept + data
        return self._take(data, _scan(data, self._dialect, whole=False, damaged=self._damaged))

    def take_remaining_messages(self) -> tuple[list[ReceivedMessage], int]:
        """The messages in what is kept, which may be damaged; the end of a frame is no longer expected."""
        return self._take(self._kept, _scan(self._kept, self._dialect, whole=True, damaged=self._damaged))

    def _take(self, data: bytes, scan: "_Scan") -> tuple[list[ReceivedMessage], int]:
        self._kept, self._damaged = data[scan.end :], scan.damaged
        self.passed += scan.end
        return scan.found, scan.damages


class _Scan(NamedTuple):
    """Content of a buffer: messages, damaged stretches, where the rest begins, whether damage precedes it."""

    found: list[ReceivedMessage]
    damages: int
    end: int
    damaged: bool


def _scan(data: bytes, dialect: Dialect, *, whole: bool, damaged: bool = False) -> _Scan:
    """The messages in a buffer, which ends with a frame if it is `whole`, else perhaps in an unfinished one."""
    found: list[ReceivedMessage] = []
    by_id, size = dialect.by_id, len(data)
    place = damages = 0
    while place < size:
        if data[place] not in MAGICS:
            damages += not damaged
            damaged = True
            magic = _magic(data, place)
            place = magic.start() if magic is not None else size
            continue
        if size - place < LONGEST_HEADER and not whole:
            break
        end, message = frame_at(data, place, by_id)
        if end > size:
            if not whole:
                break
            end = 0
        elif message is not None:
            found.append(message)
        elif end < size and data[end] not in MAGICS:  # unknown messages count as frames if one follows
            end = 0
        damages += not (end or damaged)
        damaged = not end
        place = end or place + 1
    return _Scan(found, damages, place, damaged)


def frame_at(data: bytes, start: int, by_id: Mapping[int, Definition]) -> tuple[int, ReceivedMessage | None]:
    """End of the frame that begins at `start`, and its message.

    An end of 0 means that there is none; one behind `data` that it is not complete. Without a message its checksum
    could not be checked, since `by_id` lacks the definition.
    """
    if data[start] == V2 and len(data) >= start + LONGEST_HEADER:
        length, flags, sequence, system, component, low, high = _HEADER.unpack_from(data, start)
        number, payload = low | high << 16, start + LONGEST_HEADER
        if flags & ~SIGNED:
            return 0, None
    elif data[start] == V1 and len(data) >= start + 6:
        length, sequence, system, component, number = data[start + 1 : start + 6]
        flags, payload = 0, start + 6
    else:
        return 0, None
    checksum = payload + length
    after = checksum + 2
    end = after + SIGNATURE if flags else after
    definition = by_id.get(number)
    if definition is None or end > len(data):
        return end, None
    if _crc(data[start + 1 : checksum] + definition.salt) != data[checksum] | data[checksum + 1] << 8:
        return 0, None
    message = ReceivedMessage(definition, system, component, sequence, data[payload:checksum])
    if flags:
        message.signature, message.signed = data[after:end], data[start:after]
    return end, message
