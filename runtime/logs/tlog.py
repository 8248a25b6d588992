"""Reads .tlog files: MAVLink frames, each behind the time at which a ground station received it.

Source of the form: MAVLink's telemetry logs, as QGroundControl, MAVProxy and Mission Planner write them: eight bytes,
big endian, µs since 1970 UTC, then the frame of version 1 or 2.
"""

from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from fastcrc.crc16 import mcrf4xx

CHUNK = 1 << 20
TIME = 8
HEADS = {0xFD: 10, 0xFE: 6}  # by the first byte of a frame: the length before the payload
SIGNATURE = 13
EARLIEST, LATEST = 946_684_800_000_000, 4_102_444_800_000_000  # years 2000 and 2100, µs

# pymavlink has no types.
_dialect: Any = import_module("pymavlink.dialects.v20.ardupilotmega")


class Frame(NamedTuple):
    """A received frame: s since 1970 UTC, the system and component that sent it, the message as pymavlink has it."""

    time: float
    system: int
    component: int
    message: Any


class Tlog:
    """A .tlog file.

    position: bytes read so far. lost: those that belong to no frame. frames: whole ones. unknown: those of messages
    that the dialect does not have.
    """

    def __init__(self, path: Path):
        self.path = path
        self.size = path.stat().st_size
        self.lost = 0
        self.position = 0
        self.frames = 0
        self.unknown = 0
        self._kinds: dict[int, Any] = _dialect.mavlink_map

    def read(self, names: frozenset[str]) -> Iterator[Frame]:
        """The messages of these names, in the order of the file; what is damaged is skipped and counted."""
        parser = _dialect.MAVLink(None)
        wanted = {number for number, kind in self._kinds.items() if kind.msgname in names}
        for time, data in self._frames():
            if _number(data) in wanted:
                # The CRC was right, and so pymavlink takes it.
                message = parser.decode(bytearray(data))
                yield Frame(time / 1e6, message.get_srcSystem(), message.get_srcComponent(), message)

    def _frames(self) -> Iterator[tuple[int, bytes]]:
        buffer, position = b"", 0
        with self.path.open("rb") as file:
            more = True
            while more:
                data = file.read(CHUNK)
                self.position += len(data)
                more = bool(data)
                buffer, position = buffer[position:] + data, 0
                while position < len(buffer):
                    size = self._size(buffer, position)
                    if size is None or position + size > len(buffer):
                        if more:
                            break
                        size = None if size is None else 0
                    if not size:
                        self.lost += 1
                        position += 1
                        continue
                    self.frames += 1
                    yield int.from_bytes(buffer[position : position + TIME]), buffer[position + TIME : position + size]
                    position += size

    def _size(self, buffer: bytes, position: int) -> int | None:
        """The length of the record at this place, 0 if none begins here, None if there are too few bytes to tell."""
        if position + TIME + 10 > len(buffer):
            return None
        if not EARLIEST < int.from_bytes(buffer[position : position + TIME]) < LATEST:
            return 0
        begin = position + TIME
        head = HEADS.get(buffer[begin])
        if head is None:
            return 0
        body = head + buffer[begin + 1]
        size = TIME + body + 2 + SIGNATURE * (head == 10 and buffer[begin + 2] & 1)
        if position + size > len(buffer):
            return size
        frame = buffer[begin : position + size]
        kind = self._kinds.get(_number(frame))
        if kind is None:
            # Its CRC cannot be checked; what follows it must look like a record.
            after = buffer[position + size : position + size + TIME + 1]
            good = len(after) <= TIME or (EARLIEST < int.from_bytes(after[:TIME]) < LATEST and after[TIME] in HEADS)
            self.unknown += good
            return size if good else 0
        good = mcrf4xx(frame[1:body] + bytes([kind.crc_extra])) == int.from_bytes(frame[body : body + 2], "little")
        return size if good else 0


def _number(frame: bytes) -> int:
    return int.from_bytes(frame[7:10], "little") if frame[0] == 0xFD else frame[5]
