"""MAVLink's messages: those of pymavlink's ardupilotmega dialect, and newer ones; only this module uses pymavlink."""

import importlib
import math
import struct
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from operator import itemgetter
from typing import Any

from mavlink.extra_messages import EXTENSIONS, MESSAGES, ExtraMessage

Value = int | float | bytes | Sequence[int] | Sequence[float]
Fields = Mapping[str, Value]

ENUMERATIONS = ("PLANE_MODE", "COPTER_MODE", "SUB_MODE", "ROVER_MODE", "TRACKER_MODE")
FLOAT_MAX = struct.unpack("<f", b"\xff\xff\x7f\x7f")[0]
UNSUITABLE = (KeyError, TypeError, struct.error, OverflowError)


@dataclass(frozen=True, slots=True)
class WireField:
    """A field in wire order: `kind` is its struct character ("s" for text), `length` its number of items, 0 for one."""

    name: str
    kind: str
    length: int = 0


@dataclass(frozen=True)
class Definition:
    """One message of the dialect."""

    id: int
    name: str
    crc_extra: int
    fields: tuple[WireField, ...]

    @cached_property
    def layout(self) -> struct.Struct:
        return struct.Struct("<" + "".join(f"{f.length or ''}{f.kind}" for f in self.fields))

    @cached_property
    def salt(self) -> bytes:
        """Byte that follows header and payload in the checksum."""
        return bytes((self.crc_extra,))

    @cached_property
    def size(self) -> int:
        """Bytes of the whole payload."""
        return self.layout.size

    @cached_property
    def _packer(self) -> Callable[[Fields], bytes]:
        """Packs values that need no conversion; raises one of UNSUITABLE for others."""
        names, pack = [field.name for field in self.fields], self.layout.pack
        if len(names) == 1:
            return lambda values: pack(values[names[0]])
        pick = itemgetter(*names)
        return lambda values: pack(*pick(values))

    @cached_property
    def _blank(self) -> dict[str, Value]:
        return {field.name: b"" if field.kind == "s" else 0 for field in self.fields}

    def pack(self, values: Fields) -> bytes:
        """The whole payload, with trailing zeros. Numbers are rounded and clamped to their fields; fields that
        `values` lacks are zero. Raises ValueError if the value of an integer field is not finite."""
        try:
            return self._packer(values if len(values) == len(self.fields) else {**self._blank, **values})
        except UNSUITABLE:
            return self.layout.pack(*self._fitted(values))

    def _fitted(self, values: Fields) -> Iterator[Any]:
        for item in self.fields:
            value: Any = values.get(item.name, 0)
            if item.kind == "s":
                yield value or b""
            elif item.kind == "B" and isinstance(value, bytes):  # a part of a file: each byte fits
                yield from value[: item.length].ljust(item.length, b"\0")
            elif item.length:
                given = list(value)[: item.length] if value else []
                yield from (_fit(item.kind, v) for v in given)
                yield from [0] * (item.length - len(given))
            else:
                yield _fit(item.kind, value)

    @cached_property
    def unpack(self) -> Callable[[bytes], dict[str, Any]]:
        """Gives the values in a payload by name: numbers, bytes up to the first NUL for texts, tuples for arrays.

        A short payload is filled with zeros; bytes beyond the definition are ignored.
        """
        items = ", ".join(f"{field.name!r}: {place}" for field, place in self._places())
        lines = (
            "def unpack(payload):",
            "    items = read(payload if len(payload) == size else payload[:size].ljust(size, zero))",
            f"    return {{{items}}}",
        )
        space: dict[str, Any] = {"read": self.layout.unpack, "size": self.size, "zero": b"\0"}
        # Compiled, since a dict of named items takes half the time of one that is made from pairs.
        exec(compile("\n".join(lines), f"<mavlink {self.name}>", "exec"), space)
        return space["unpack"]

    def _places(self) -> Iterator[tuple[WireField, str]]:
        """Each field, and the Python expression that takes it from `items`."""
        place = 0
        for field in self.fields:
            if field.kind == "s":
                yield field, f"items[{place}].partition(zero)[0]"
            elif field.length > 1:
                yield field, f"items[{place}:{place + field.length}]"
            else:
                yield field, f"items[{place}]"
            place += field.length if field.kind != "s" and field.length else 1

    def pad_payload(self, payload: bytes) -> bytes:
        """`payload`, cut or filled with zeros to the size of the definition."""
        return payload[: self.size].ljust(self.size, b"\0")


class Dialect:
    """A set of definitions, by id and by name, and the names of enumeration values without their prefix."""

    def __init__(self, definitions: Iterable[Definition], enumerations: Mapping[str, Mapping[int, str]]):
        self.enumerations = enumerations
        self.by_id: dict[int, Definition] = {}
        self.by_name: dict[str, Definition] = {}
        for definition in definitions:
            self.by_id[definition.id] = self.by_name[definition.name] = definition


def load_dialect() -> Dialect:
    """The dialect. Raises ImportError if pymavlink (the extra "mavlink") is not installed."""
    module: Any = importlib.import_module("pymavlink.dialects.v20.ardupilotmega")
    known = [_definition(message) for message in module.mavlink_map.values()]
    numbers = {definition.id for definition in known}
    newer = [_addition(message) for message in MESSAGES if message.id not in numbers]
    return Dialect([*known, *newer], {name: _names(name, module.enums[name]) for name in ENUMERATIONS})


def _names(name: str, values: Any) -> dict[int, str]:
    names = {value: entry.name.removeprefix(f"{name}_") for value, entry in values.items()}
    return {value: text for value, text in names.items() if text != "ENUM_END"}


def _definition(message: Any) -> Definition:
    kinds = _kinds(message.unpacker.format)
    fields = [
        WireField(name, kind, length) for name, (kind, length) in zip(message.ordered_fieldnames, kinds, strict=True)
    ]
    present = {field.name for field in fields}
    newer = (WireField(name, kind) for name, kind in EXTENSIONS.get(message.msgname, ()) if name not in present)
    return Definition(message.id, message.msgname, message.crc_extra, (*fields, *newer))


def _addition(message: ExtraMessage) -> Definition:
    fields = tuple(WireField(name, kind, length) for name, kind, length in message.wire_fields)
    return Definition(message.id, message.name, message.crc_extra, fields)


def _kinds(layout: str) -> list[tuple[str, int]]:
    kinds: list[tuple[str, int]] = []
    digits = ""
    for character in layout.lstrip("<"):
        if character.isdigit():
            digits += character
        else:
            kinds.append((character, int(digits or "0")))
            digits = ""
    return kinds


def _fit(kind: str, value: float) -> float:
    if kind == "f":
        return max(-FLOAT_MAX, min(FLOAT_MAX, value)) if math.isfinite(value) else value
    if kind == "d":
        return value
    if not math.isfinite(value):
        raise ValueError(f"{value} in an integer field")
    bits = 8 * struct.calcsize(f"<{kind}")
    low, high = (0, (1 << bits) - 1) if kind.isupper() else (-(1 << bits - 1), (1 << bits - 1) - 1)
    return max(low, min(high, round(value)))
