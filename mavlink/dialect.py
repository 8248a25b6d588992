"""MAVLink's messages as pymavlink's ardupilotmega dialect defines them; the only module that uses pymavlink."""

import importlib
import math
import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

Value = int | float | bytes | Sequence[int] | Sequence[float]
Fields = Mapping[str, Value]

ENUMERATIONS = ("PLANE_MODE", "COPTER_MODE", "SUB_MODE", "ROVER_MODE", "TRACKER_MODE")
FLOAT_MAX = struct.unpack("<f", b"\xff\xff\x7f\x7f")[0]
EXTENSIONS: Mapping[str, Sequence[tuple[str, str]]] = {
    # newer than the dialect; without the target, two clients would take each other's answers
    "TIMESYNC": (("target_system", "B"), ("target_component", "B")),
}


@dataclass(frozen=True, slots=True)
class Field:
    """A field in wire order: `kind` is its struct character ("s" for text), `length` its number of items, 0 for one."""

    name: str
    kind: str
    length: int = 0


@dataclass(frozen=True, slots=True)
class Definition:
    """One message of the dialect."""

    id: int
    name: str
    crc_extra: int
    fields: tuple[Field, ...]
    layout: struct.Struct = field(init=False)

    def __post_init__(self) -> None:
        text = "".join(f"{f.length or ''}{f.kind}" for f in self.fields)
        object.__setattr__(self, "layout", struct.Struct("<" + text))

    def pack(self, values: Fields) -> bytes:
        """The whole payload, with trailing zeros. Numbers are rounded and clamped to their fields; fields that
        `values` lacks are zero. Raises ValueError if the value of an integer field is not finite."""
        items: list[Any] = []
        for item in self.fields:
            value: Any = values.get(item.name, 0)
            if item.kind == "s":
                items.append(value or b"")
            elif item.length:
                given = list(value)[: item.length] if value else []
                items.extend(_fit(item.kind, v) for v in given)
                items.extend([0] * (item.length - len(given)))
            else:
                items.append(_fit(item.kind, value))
        return self.layout.pack(*items)

    def unpack(self, payload: bytes) -> dict[str, Any]:
        """Values by name: numbers, bytes up to the first NUL for texts, tuples for arrays.

        A short payload is filled with zeros; bytes beyond the definition are ignored.
        """
        items = self.layout.unpack(self.fill(payload))
        values: dict[str, Any] = {}
        place = 0
        for item in self.fields:
            count = item.length if item.length and item.kind != "s" else 1
            value: Any = items[place : place + count] if count > 1 else items[place]
            values[item.name] = value.partition(b"\0")[0] if item.kind == "s" else value
            place += count
        return values

    def fill(self, payload: bytes) -> bytes:
        """`payload`, cut or filled with zeros to the size of the definition."""
        size = self.layout.size
        return payload[:size].ljust(size, b"\0")


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
    definitions = (_definition(message) for message in module.mavlink_map.values())
    return Dialect(definitions, {name: _names(name, module.enums[name]) for name in ENUMERATIONS})


def _names(name: str, values: Any) -> dict[int, str]:
    names = {value: entry.name.removeprefix(f"{name}_") for value, entry in values.items()}
    return {value: text for value, text in names.items() if text != "ENUM_END"}


def _definition(message: Any) -> Definition:
    kinds = _kinds(message.unpacker.format)
    fields = [Field(name, kind, length) for name, (kind, length) in zip(message.ordered_fieldnames, kinds, strict=True)]
    fields.extend(Field(name, kind) for name, kind in EXTENSIONS.get(message.msgname, ()))
    return Definition(message.id, message.msgname, message.crc_extra, tuple(fields))


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
