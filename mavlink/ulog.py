"""Reads ULog files: the logs of PX4.

Source of the format: PX4's "ULog File Format", version 1. A message has its size, its type and no checksum, so a
damaged one is known by what does not follow it. pyulog loses all that follows damage in a file without marks of
synchronization, and looks at each byte of a hole.
"""

import mmap
import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass

from mavlink.log_record_scanner import LogRecord, RecordLog, RecordScanner, RecordTimes

MAGIC = b"ULog\x01\x12\x35"
BEGIN = struct.Struct("<7sBQ")  # magic, version, µs at the start
HEAD = struct.Struct("<HB")
SYNC = b"\x2f\x73\x13\x20\x25\x0c\xbb\x12"
STRUCTS = {
    **{"int8_t": "b", "uint8_t": "B", "int16_t": "h", "uint16_t": "H", "int32_t": "i", "uint32_t": "I"},
    **{"int64_t": "q", "uint64_t": "Q", "float": "f", "double": "d", "bool": "?", "char": "c"},
}
SMALLEST = {b"B": 40, b"F": 3, b"I": 3, b"M": 4, b"P": 3, b"Q": 4, b"A": 4, b"R": 2, b"L": 9, b"C": 11, b"O": 2}
"""Types of messages and the fewest bytes in them; D and S are known better."""

APPENDED = 1  # the only flag that a reader may ignore
MOST_FIELDS, DEEPEST = 4096, 8
TEXT, PARAMETER, DROPOUT, INFO = "L", "P", "O", "I"
"""Names of the records that are no topics: a text with `level`, a parameter, ms without data, a `key` of the system."""


class BadULog(ValueError):
    """A file that cannot be read at all."""


@dataclass(frozen=True, slots=True)
class _Topic:
    """A subscription: messages have `fields.size` bytes, `longest` with those that fill them up."""

    name: str
    instance: int
    fields: struct.Struct
    columns: tuple[str, ...]
    longest: int


class ULog(RecordLog):
    """A ULog file."""

    def read(self, names: frozenset[str]) -> Iterator[LogRecord]:
        """The records with these names, in the order of the file; damage is skipped and counted. Raises BadULog."""
        if self.size < BEGIN.size:
            raise BadULog(f"{self.path}: the file ends in its first {BEGIN.size} bytes")
        with self.path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            if not data[: BEGIN.size].startswith(MAGIC):
                raise BadULog(f"{self.path}: does not begin as a ULog file does")
            yield from self._records(data, names)

    def _records(self, data: mmap.mmap, names: frozenset[str]) -> Iterator[LogRecord]:
        clock, damaged = RecordTimes(), 0
        clock.accepts(BEGIN.unpack(data[: BEGIN.size])[2] / 1e6)
        definitions = _Definitions(data)
        chain = RecordScanner(data, BEGIN.size, definitions)
        while (start := chain.find_next_record()) >= 0:
            self.note_progress(chain, damaged)
            kind, content = data[start + 2 : start + 3], data[start + HEAD.size : chain.position]
            if kind == b"D":
                topic = definitions.topics[content[0] | content[1] << 8]
                if topic.name not in names:
                    continue
                values = dict(zip(topic.columns, topic.fields.unpack_from(content, 2), strict=True))
                time, name, instance = values["timestamp"] / 1e6, topic.name, topic.instance
            elif kind == b"B" and (content[8] & ~APPENDED or any(content[9:16])):
                raise BadULog(f"{self.path}: is of a newer kind of ULog, which cannot be read")
            elif (found := _other(kind, content, clock.last or 0.0)) is not None and found.name in names:
                time, name, values, instance = found
            else:
                continue
            if clock.accepts(time):
                yield LogRecord(time, name, values, instance)
            else:
                damaged += chain.position - start
                chain.note_damage(start)
        self.note_progress(chain, damaged)


_SYNCHRONIZED = re.compile(re.escape(HEAD.pack(len(SYNC), ord("S")) + SYNC))


class _Definitions:
    """Definitions of messages that were read from a file so far."""

    def __init__(self, data: mmap.mmap) -> None:
        self.topics: dict[int, _Topic] = {}
        self._formats: dict[str, list[tuple[str, int, str]]] = {}
        self.pattern = _SYNCHRONIZED
        self._data = data

    def length_at(self, place: int) -> int:
        head = self._data[place : place + HEAD.size + 2]
        if len(head) < HEAD.size:
            return 0
        size, kind = head[0] | head[1] << 8, head[2:3]
        if kind == b"D" and len(head) == HEAD.size + 2:
            topic = self.topics.get(head[3] | head[4] << 8)
            return HEAD.size + size if topic and topic.fields.size <= size - 2 <= topic.longest else 0
        if kind == b"S":
            return HEAD.size + size if self._data[place + HEAD.size : place + HEAD.size + size] == SYNC else 0
        return HEAD.size + size if size >= SMALLEST.get(kind, 1 << 16) else 0

    def learn(self, start: int, end: int) -> bool | None:
        kind, content = self._data[start + 2 : start + 3], self._data[start + HEAD.size : end]
        known = (kind == b"F" and self._define(content)) or (kind == b"A" and self._subscribe(content))
        return known or None  # an odd one may be of a newer PX4: what follows it decides

    def _define(self, content: bytes) -> bool:
        """Take a format: NAME:TYPE FIELD;TYPE[COUNT] FIELD; and so on. One that is damaged is left out."""
        name, _, fields = content.decode("utf-8", "replace").partition(":")
        found = [re.fullmatch(r"([\w/-]+)(?:\[(\d{1,4})\])? (\w+)", field) for field in fields.split(";") if field]
        if not all(found):
            return False
        self._formats[name] = [(f[1], int(f[2]) if f[2] else 0, f[3]) for f in found if f]
        return True

    def _subscribe(self, content: bytes) -> bool:
        """Take the topic of a number, unless its format is unknown or damaged."""
        instance, number, name = content[0], content[1] | content[2] << 8, content[3:].decode("utf-8", "replace")
        try:
            fields = list(self._flat(name, "", DEEPEST))
        except (KeyError, ValueError):
            return False
        longest = struct.calcsize("<" + "".join(letter for letter, _ in fields))
        while fields and fields[-1][1].startswith("_padding"):
            fields.pop()
        letters = struct.Struct("<" + "".join(letter for letter, _ in fields))
        if ("Q", "timestamp") not in fields or longest + 2 >= 1 << 16:
            return False
        self.topics[number] = _Topic(name, instance, letters, tuple(column for _, column in fields), longest)
        # Sure are the size, type and number of a topic's messages, and marks of synchronization.
        heads = {
            HEAD.pack(size + 2, ord("D")) + struct.pack("<H", number)
            for number, topic in self.topics.items()
            for size in (topic.fields.size, topic.longest)
        }
        self.pattern = re.compile(b"|".join([_SYNCHRONIZED.pattern, *map(re.escape, sorted(heads))]), re.DOTALL)
        return True

    def _flat(self, name: str, prefix: str, depth: int) -> Iterator[tuple[str, str]]:
        """Letters for struct and names of the fields of a format, those of formats in it like q[0] and esc[1].rpm."""
        if not depth:
            raise ValueError(name)
        number = 0
        for kind, count, field in self._formats[name]:
            for column in [f"{prefix}{field}[{index}]" for index in range(count)] if count else [prefix + field]:
                within = [(STRUCTS[kind], column)] if kind in STRUCTS else self._flat(kind, column + ".", depth - 1)
                for found in within:
                    number += 1
                    if number > MOST_FIELDS:
                        raise ValueError(name)
                    yield found


def _other(kind: bytes, content: bytes, now: float) -> LogRecord | None:
    """A message that belongs to no topic; None if it is damaged, or not of use."""
    if kind in (b"L", b"C"):
        words = content[9:] if kind == b"L" else content[11:]
        (time,) = struct.unpack_from("<Q", content, 1 if kind == b"L" else 3)
        return LogRecord(time / 1e6, TEXT, {"level": content[0] - ord("0"), "text": words.decode("utf-8", "replace")})
    if kind == b"O":
        return LogRecord(now, DROPOUT, {"ms": content[0] | content[1] << 8})
    if kind not in (b"P", b"I"):
        return None
    name = re.fullmatch(r"(\w+)(?:\[\d+\])? (\w+)", content[1 : 1 + content[0]].decode("utf-8", "replace"))
    value = content[1 + content[0] :]
    if name is None:
        return None
    if name[1] == "char":
        return LogRecord(now, kind.decode(), {"key": name[2], "value": value.decode("utf-8", "replace")})
    letter = STRUCTS.get(name[1], "")
    if not letter or len(value) != struct.calcsize("<" + letter):
        return None
    return LogRecord(now, kind.decode(), {"key": name[2], "value": struct.unpack("<" + letter, value)[0]})
