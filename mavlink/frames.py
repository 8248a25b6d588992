"""Frames of MAVLink 1 and 2 in datagrams."""

from dataclasses import dataclass
from typing import Any, NamedTuple

from fastcrc import crc16

from mavlink.dialect import Definition, Dialect

V1, V2 = 0xFE, 0xFD
MAGICS = (V1, V2)
SIGNED = 0x01
SIGNATURE = 13
LONGEST_DATAGRAM = 8192
LONGEST_HEADER = 10


@dataclass(frozen=True, slots=True)
class Received:
    """A received message: `payload` has the full length of the definition, `values` are its fields."""

    definition: Definition
    system: int
    component: int
    payload: bytes
    values: dict[str, Any]

    @property
    def name(self) -> str:
        return self.definition.name


def encode(definition: Definition, payload: bytes, sequence: int, system: int, component: int) -> bytes:
    """A MAVLink 2 frame: zeros at the end of the payload are cut, but never its first byte."""
    body = payload.rstrip(b"\0") or payload[:1]
    frame = bytes((V2, len(body), 0, 0, sequence, system, component)) + definition.id.to_bytes(3, "little") + body
    return frame + _checksum(frame[1:], definition).to_bytes(2, "little")


def split(datagram: bytes, dialect: Dialect) -> tuple[list[Received], int]:
    """The messages in a datagram, and the number of damaged stretches.

    No state is kept between datagrams, and a damaged frame does not hide a good one after it. Frames of messages that
    the dialect lacks are skipped. Signatures are not checked.
    """
    found: list[Received] = []
    place = damages = 0
    damaged = False
    while place < len(datagram):
        length, message = _message_at(datagram, place, dialect)
        if length:
            damaged = False
            if message is not None:
                found.append(message)
        elif not damaged:
            damaged = True
            damages += 1
        place += length or 1
    return found, damages


class FrameHeader(NamedTuple):
    """Offsets of the parts of a frame in a buffer (start, payload, checksum, end), and its header fields."""

    start: int
    payload: int
    checksum: int
    end: int
    id: int
    system: int
    component: int


def frame_at(data: bytes, start: int) -> FrameHeader | None:
    """The frame whose header begins at `start`; its end may lie beyond the buffer. None if no frame can begin there."""
    if data[start] == V2 and len(data) >= start + LONGEST_HEADER:
        flags, system, component = data[start + 2], data[start + 5], data[start + 6]
        number = int.from_bytes(data[start + 7 : start + LONGEST_HEADER], "little")
        payload = start + LONGEST_HEADER
    elif data[start] == V1 and len(data) >= start + 6:
        flags, system, component, number = 0, data[start + 3], data[start + 4], data[start + 5]
        payload = start + 6
    else:
        return None
    if flags & ~SIGNED:
        return None
    checksum = payload + data[start + 1]
    end = checksum + 2 + (SIGNATURE if flags & SIGNED else 0)
    return FrameHeader(start, payload, checksum, end, number, system, component)


def is_intact(data: bytes, frame: FrameHeader, definition: Definition) -> bool:
    """Whether the checksum of a whole frame is right for its message."""
    given = int.from_bytes(data[frame.checksum : frame.checksum + 2], "little")
    return _checksum(data[frame.start + 1 : frame.checksum], definition) == given


def received(data: bytes, frame: FrameHeader, definition: Definition) -> Received:
    """The message in an intact frame."""
    payload = definition.fill(data[frame.payload : frame.checksum])
    return Received(definition, frame.system, frame.component, payload, definition.unpack(payload))


def _message_at(data: bytes, start: int, dialect: Dialect) -> tuple[int, Received | None]:
    """Length of the frame at `start` (0: there is none), and its message (None: the dialect lacks it)."""
    frame = frame_at(data, start)
    if frame is None or frame.end > len(data):
        return 0, None
    definition = dialect.by_id.get(frame.id)
    if definition is None:  # checking the checksum needs the definition; instead, a frame must follow
        return (frame.end - start, None) if frame.end == len(data) or data[frame.end] in MAGICS else (0, None)
    if not is_intact(data, frame, definition):
        return 0, None
    return frame.end - start, received(data, frame, definition)


def _checksum(content: bytes, definition: Definition) -> int:
    return crc16.mcrf4xx(content + bytes((definition.crc_extra,)))
