"""Records without a checksum, one after the other in a file: where each begins and ends, and what is damaged."""

import mmap
import re
from pathlib import Path
from typing import Any, NamedTuple, Protocol

HEAD = 3  # bytes that records of both formats begin with; fewer at the end of a file are the rest of one
LONGEST_JUMP = 60.0  # s; a time that is farther from the last one counts if the next one agrees


class LogRecord(NamedTuple):
    """A record: time in s since the autopilot started, name, values by field, number of the sensor among its kind."""

    time: float
    name: str
    values: dict[str, Any]
    instance: int = 0


class RecordDefinitions(Protocol):
    """Definitions of records that were read from a file so far.

    pattern: what records begin with; the search for it skips damage at the speed of C.
    """

    pattern: re.Pattern[bytes]

    def length_at(self, place: int) -> int:
        """The length of the record that may begin at a place; 0 if none can."""
        ...

    def learn(self, start: int, end: int) -> bool | None:
        """Take the definition in the record at a place; False if it contradicts itself, None if there is none."""
        ...


class RecordScanner:
    """Finds records in `data`.

    A record counts if it defines others, or if another one or the end of the file follows it: of one that damage
    follows, the end may be missing.

    position: where the next one begins. lost: bytes outside of records; first_lost: the place of the first, or -1.
    records: how many were found.
    """

    def __init__(self, data: mmap.mmap, position: int, definitions: RecordDefinitions):
        self.position: int = position
        self.lost: int = 0
        self.records: int = 0
        self.first_lost: int = -1
        self._data = data
        self._size = len(data)
        self._definitions = definitions

    def find_next_record(self) -> int:
        """Offset of the next record, after which `position` is its end; -1 if there is none."""
        while self.position < self._size:
            start = self.position
            length = self._definitions.length_at(start)
            end = start + length
            if length and end <= self._size:
                learned = self._definitions.learn(start, end)
                if self._continues(end) if learned is None else learned:
                    self.position = end
                    self.records += 1
                    return start
            after = self._definitions.pattern.search(self._data, start + 1)
            self.position = after.start() if after else self._size
            self.lost += self.position - start
            self.note_damage(start)
        return -1

    def note_damage(self, start: int) -> None:
        """Note that there is damage at a place."""
        self.first_lost = start if self.first_lost < 0 else min(start, self.first_lost)

    def _continues(self, end: int) -> bool:
        return self._size - end < HEAD or self._definitions.length_at(end) > 0


class RecordLog:
    """A file of records, and how far it has been read.

    position: bytes read so far. lost: bytes outside of records, and of those that are damaged. records: number of whole
    ones.
    """

    def __init__(self, path: Path):
        self.path = path
        self.size: int = path.stat().st_size
        self.position: int = 0
        self.lost: int = 0
        self.records: int = 0
        self.first_lost: int = -1

    def note_progress(self, scanner: RecordScanner, damaged: int) -> None:
        """Take what a scanner has read, of which `damaged` bytes are records that cannot be right."""
        self.position, self.lost, self.records = scanner.position, scanner.lost + damaged, scanner.records
        self.first_lost = scanner.first_lost


class RecordTimes:
    """Times of records; one that is far from the others is damaged."""

    def __init__(self) -> None:
        self.last: float | None = None
        self._doubtful: float | None = None

    def accepts(self, time: float) -> bool:
        """Whether the next record can have this time."""
        if self.last is not None and abs(time - self.last) > LONGEST_JUMP:
            sure = self._doubtful is not None and abs(time - self._doubtful) <= LONGEST_JUMP
            self._doubtful = time
            if not sure:
                return False
        self.last, self._doubtful = time, None
        return True
