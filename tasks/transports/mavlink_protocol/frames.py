"""Frames of MAVLink 1 and 2 in datagrams."""

from dataclasses import dataclass
from typing import Any

from fastcrc import crc16

from tasks.transports.mavlink_protocol.dialect import Definition, Dialect

V1, V2 = 0xFE, 0xFD
MAGICS = (V1, V2)
SIGNED = 0x01
SIGNATURE = 13
LONGEST_DATAGRAM = 8192


@dataclass(frozen=True, slots=True)
class Received:
    """A message that somebody sent: `payload` is as long as the definition, `values` what it says."""

    definition: Definition
    system: int
    component: int
    payload: bytes
    values: dict[str, Any]

    @property
    def name(self) -> str:
        return self.definition.name


def encode(definition: Definition, payload: bytes, sequence: int, system: int, component: int) -> bytes:
    """A MAVLink 2 frame: zeros at the end of the payload are left out, but never its first byte."""
    body = payload.rstrip(b"\0") or payload[:1]
    frame = bytes((V2, len(body), 0, 0, sequence, system, component)) + definition.id.to_bytes(3, "little") + body
    return frame + _checksum(frame[1:], definition).to_bytes(2, "little")


def split(datagram: bytes, dialect: Dialect) -> tuple[list[Received], int]:
    """The frames in a datagram, and how many runs of bytes there are no frames.

    No state is kept from one datagram to the next, and a damaged frame does not hide the good one behind it. Frames of
    messages that the dialect lacks are passed over. Signatures are not checked.
    """
    found: list[Received] = []
    place = damages = 0
    damaged = False
    while place < len(datagram):
        length, message = _frame_at(datagram, place, dialect)
        if length:
            damaged = False
            if message is not None:
                found.append(message)
        elif not damaged:
            damaged = True
            damages += 1
        place += length or 1
    return found, damages


def _frame_at(data: bytes, start: int, dialect: Dialect) -> tuple[int, Received | None]:
    """Length of the frame that begins at `start`, 0 where none does, and its message where the dialect knows it."""
    head = 10 if data[start] == V2 else 6
    if data[start] not in MAGICS or len(data) < start + head + 2:
        return 0, None
    if head == 10:
        flags, system, component = data[start + 2], data[start + 5], data[start + 6]
        number = int.from_bytes(data[start + 7 : start + 10], "little")
    else:
        flags, system, component, number = 0, data[start + 3], data[start + 4], data[start + 5]
    tail = start + head + data[start + 1]
    end = tail + 2 + (SIGNATURE if flags & SIGNED else 0)
    if end > len(data) or flags & ~SIGNED:
        return 0, None
    definition = dialect.by_id.get(number)
    if definition is None:
        return (end - start, None) if end == len(data) or data[end] in MAGICS else (0, None)
    if _checksum(data[start + 1 : tail], definition) != int.from_bytes(data[tail : tail + 2], "little"):
        return 0, None
    payload = definition.fill(data[start + head : tail])
    return end - start, Received(definition, system, component, payload, definition.unpack(payload))


def _checksum(content: bytes, definition: Definition) -> int:
    return crc16.mcrf4xx(content + bytes((definition.crc_extra,)))
