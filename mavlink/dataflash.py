"""Reads DataFlash logs: the .BIN files that ArduPilot writes.

Source of the format: ArduPilot's AP_Logger. A record is A3 95, its type, and the fields that an FMT record has
declared for this type. There is no checksum, so a damaged record is known by what does not follow it. pymavlink's
DFReader ends at the first damage with an unknown type, and prints a line for each byte of a hole.
"""

import mmap
import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from mavlink.log_record_scanner import LogRecord, RecordLog, RecordScanner, RecordTimes

HEAD = b"\xa3\x95"
HEADER = len(HEAD) + 1
FMT = 128
FMT_FIELDS = struct.Struct("<BB4s16s64s")
STRUCTS = {
    **{letter: letter for letter in "bBhHiIfdqQ"},
    **{"a": "64s", "g": "e", "n": "4s", "N": "16s", "Z": "64s", "c": "h", "C": "H", "e": "i", "E": "I"},
    **{"L": "i", "M": "B"},
}
PARTS = {"c": 100.0, "C": 100.0, "e": 100.0, "E": 100.0, "L": 1e7}
"""Fields that are integers of such parts."""

TEXTS = "nNZ"


@dataclass(frozen=True, slots=True)
class _Format:
    name: str
    length: int
    fields: struct.Struct
    letters: str
    columns: tuple[str, ...]

    def unpack(self, data: bytes) -> dict[str, Any]:
        return {
            column: _value(letter, value)
            for column, letter, value in zip(self.columns, self.letters, self.fields.unpack(data), strict=True)
        }


COLUMNS = ("Type", "Length", "Name", "Format", "Columns")
FORMATS = _Format("FMT", HEADER + FMT_FIELDS.size, FMT_FIELDS, "BBnNZ", COLUMNS)


class DataFlash(RecordLog):
    """A DataFlash log."""

    def read(self, names: frozenset[str]) -> Iterator[LogRecord]:
        """The records with these names, in the order of the file; damage is skipped and counted."""
        if not self.size:
            return
        with self.path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            yield from self._records(data, names)

    def _records(self, data: mmap.mmap, names: frozenset[str]) -> Iterator[LogRecord]:
        clock, damaged = RecordTimes(), 0
        definitions = _Definitions(data)
        chain = RecordScanner(data, 0, definitions)
        while (start := chain.find_next_record()) >= 0:
            self.note_progress(chain, damaged)
            kind = definitions.formats[data[start + 2]]
            if kind.name not in names:
                continue
            values = kind.unpack(data[start + HEADER : chain.position])
            time = _time(values, clock)
            if clock.accepts(time):
                yield LogRecord(time, kind.name, values)
            else:
                damaged += kind.length
                chain.note_damage(start)
        self.note_progress(chain, damaged)


class _Definitions:
    """The formats that a log has declared so far, by type."""

    def __init__(self, data: mmap.mmap) -> None:
        self.formats = {FMT: FORMATS}
        self.pattern = _headers(self.formats)
        self._data = data

    def length_at(self, place: int) -> int:
        header = self._data[place : place + HEADER]
        kind = self.formats.get(header[2]) if len(header) == HEADER and header.startswith(HEAD) else None
        return kind.length if kind else 0

    def learn(self, start: int, end: int) -> bool | None:
        if self._data[start + 2] != FMT:
            return None
        values = FORMATS.unpack(self._data[start + HEADER : end])
        declared = _declared(values)
        if declared is not None and values["Type"] != FMT:
            self.formats[values["Type"]] = declared
            self.pattern = _headers(self.formats)
        return declared is not None


def _time(values: dict[str, Any], clock: RecordTimes) -> float:
    """Seconds since the start; those of the record before it if this one has none."""
    if "TimeUS" in values:
        return values["TimeUS"] / 1e6
    return values["TimeMS"] / 1e3 if "TimeMS" in values else clock.last or 0.0


def _headers(formats: dict[int, _Format]) -> re.Pattern[bytes]:
    """Headers of the types that are declared, and of FMT with the beginning of a name."""
    types = b"".join(re.escape(bytes((number,))) for number in sorted(formats) if number != FMT)
    others = b"|[" + types + b"]" if types else b""
    return re.compile(HEAD + rb"(?:\x80..[!-~]" + others + b")", re.DOTALL)


def _declared(values: dict[str, Any]) -> _Format | None:
    """The format that an FMT record declares; None if it contradicts itself, and so is damaged."""
    letters, columns = values["Format"], tuple(values["Columns"].split(",")) if values["Columns"] else ()
    if not all(letter in STRUCTS for letter in letters) or len(letters) != len(columns):
        return None
    fields = struct.Struct("<" + "".join(STRUCTS[letter] for letter in letters))
    if values["Length"] != HEADER + fields.size:
        return None
    return _Format(values["Name"], values["Length"], fields, letters, columns)


def _value(letter: str, value: Any) -> Any:
    if letter in TEXTS:
        return value.split(b"\0")[0].decode("utf-8", "replace")
    return value / PARTS[letter] if letter in PARTS else value
