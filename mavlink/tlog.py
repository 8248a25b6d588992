"""Reads .tlog files: MAVLink frames, each after the time at which a ground station received it.

Source of the format: MAVLink's telemetry logs, as QGroundControl, MAVProxy and Mission Planner write them: eight bytes,
big endian, µs since 1970 UTC, then the frame of version 1 or 2.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from mavlink.dialect import Dialect
from mavlink.frames import LONGEST_HEADER, MAGICS, ReceivedMessage, frame_at

CHUNK = 1 << 20
TIME = 8
EARLIEST, LATEST = 946_684_800_000_000, 4_102_444_800_000_000  # years 2000 and 2100, µs
RECORD = re.compile(rb"\x00[\x03-\x0e].{6}[\xfd\xfe]", re.DOTALL)
"""First bytes of a time from EARLIEST to LATEST and a frame after it: Python skips other bytes, which would be slow."""


HEAD = 1 << 16  # bytes at the beginning of a file that show whether it has times


class RecordedMessage(NamedTuple):
    """A message, and when the recorder received it, in s since 1970 UTC."""

    time: float
    message: ReceivedMessage


class Tlog:
    """A .tlog file.

    position: bytes read so far. lost: bytes outside of frames; first_lost: the place of the first, or -1. frames:
    number of whole frames. unknown: how many of them have messages that the dialect lacks.
    """

    def __init__(self, path: Path, dialect: Dialect):
        self.path = path
        self.size: int = path.stat().st_size
        self.lost: int = 0
        self.first_lost: int = -1
        self.position: int = 0
        self.frames: int = 0
        self.unknown: int = 0
        self._dialect = dialect

    def read(self, names: frozenset[str]) -> Iterator[RecordedMessage]:
        """The messages with these names, in the order of the file; damage is skipped and counted."""
        for time, message in self._frames():
            if message is not None and message.name in names:
                yield RecordedMessage(time / 1e6, message)

    def _frames(self) -> Iterator[tuple[int, ReceivedMessage | None]]:
        """Time in µs and message of each frame; None if the dialect lacks it."""
        buffer, position = b"", 0
        with self.path.open("rb") as file:
            more = True
            while more:
                data = file.read(CHUNK)
                self.position += len(data)
                more = bool(data)
                buffer, position = buffer[position:] + data, 0
                while found := RECORD.search(buffer, position):
                    self._lose(position, found.start(), buffer)
                    position = found.start()
                    end, message = self._record_at(buffer, position)
                    cut = position + TIME + LONGEST_HEADER > len(buffer) or end > len(buffer)
                    if cut and more:
                        break
                    if cut or not end:
                        self._lose(position, position + 1, buffer)
                        position += 1
                        continue
                    self.frames += 1
                    self.unknown += message is None
                    yield int.from_bytes(buffer[position : position + TIME]), message
                    position = end
                else:
                    kept = min(TIME, len(buffer) - position) if more else 0  # the start of a record may be among them
                    self._lose(position, len(buffer) - kept, buffer)
                    position = len(buffer) - kept

    def _lose(self, start: int, end: int, buffer: bytes) -> None:
        if end > start:
            self.lost += end - start
            if self.first_lost < 0:
                self.first_lost = self.position - len(buffer) + start

    def _record_at(self, buffer: bytes, position: int) -> tuple[int, ReceivedMessage | None]:
        """End and message of the record at `position`; the end is 0 if there is none, see `frame_at`."""
        if position + TIME >= len(buffer) or not _is_time(buffer, position):
            return 0, None
        end, message = frame_at(buffer, position + TIME, self._dialect.by_id)
        if message is None and end:
            # Checking the checksum needs the definition; instead, a record must follow.
            after = buffer[end : end + TIME + 1]
            if len(after) > TIME and not (_is_time(after, 0) and after[TIME] in MAGICS):
                return 0, None
        return end, message


def _is_time(buffer: bytes, position: int) -> bool:
    return EARLIEST < int.from_bytes(buffer[position : position + TIME]) < LATEST


def lacks_times(path: Path, dialect: Dialect) -> bool:
    """Whether a file has MAVLink frames that follow each other without times, as the .tlog.raw of MAVProxy has."""
    with path.open("rb") as file:
        data = file.read(HEAD)
    joined = timed = position = 0
    while position < len(data):
        end, message = frame_at(data, position, dialect.by_id) if data[position] in MAGICS else (0, None)
        if message is None or end > len(data):
            position += 1
            continue
        joined += end < len(data) and data[end] in MAGICS
        timed += end + TIME < len(data) and data[end + TIME] in MAGICS and _is_time(data, end)
        position = end
    return joined > timed
