"""Common Data Representation (plain CDR, little endian), the encoding of ROS 2 messages.

Source: OMG DDS-XTypes 1.3, 7.4.1 (XCDR version 1): numbers lie at multiples of their size, counted behind the four
bytes that say which encapsulation it is; a string has its length with the NUL at its end before it.
"""

import json
import struct
from collections.abc import Callable, Iterable, Sequence
from operator import attrgetter
from typing import Any

import numpy as np

import imc
from runtime.logs.headers import Array
from runtime.logs.ros_messages import Member, RosType

HEADER = frozenset({"timestamp", "src", "src_ent", "dst", "dst_ent"})
ENCAPSULATION = b"\0\1\0\0"
CODES = {"b": "i1", "B": "u1", "h": "<i2", "H": "<u2", "i": "<i4", "I": "<u4", "q": "<i8", "f": "<f4", "d": "<f8"}
SIZES = {code: struct.calcsize("<" + code) for code in CODES}

Item = tuple[str, str] | tuple[str, str, int] | bytes


class Record:
    """Records of one size as a NumPy array: `prefix` as it is, then numbers at their places and constant texts.

    items: (name, letter of struct), (name, letter, count) or the bytes of a constant text.
    """

    def __init__(self, prefix: Sequence[tuple[str, str]], items: Iterable[Item]):
        names, formats, offsets = [name for name, _ in prefix], [CODES[code] for _, code in prefix], list[int]()
        place = 0
        for _, code in prefix:
            offsets.append(place)
            place += SIZES[code]
        template = bytearray(place) + ENCAPSULATION
        origin = len(template)
        for item in items:
            code = "I" if isinstance(item, bytes) else item[1]
            template += bytes(-(len(template) - origin) % SIZES[code])
            if isinstance(item, bytes):
                template += text(item)
                continue
            count = item[2] if len(item) == 3 else 1
            names.append(item[0])
            formats.append(CODES[code] if len(item) == 2 else f"{count}{CODES[code]}")
            offsets.append(len(template))
            template += bytes(count * SIZES[code])
        self.size = len(template)
        self.data_size = self.size - place
        self._template = bytes(template)
        self._dtype = np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": self.size})

    def make(self, count: int) -> Array:
        """So many records, all numbers zero."""
        return np.frombuffer(bytearray(self._template * count), self._dtype)


def text(data: bytes) -> bytes:
    """A string with its length; it must begin at a multiple of four."""
    return struct.pack("<I", len(data) + 1) + data + b"\0"


class Unfit(ValueError):
    """A message that its ROS type cannot hold; the text says why."""


class Writer:
    """Writes the fields of messages of one class, of any size, behind what is already in a buffer."""

    def __init__(self, type_: RosType, inside: bool = False):
        self._steps: list[_Step] = []
        numbers: list[Member] = []
        for member in type_.members:
            if member.code not in "TRML":
                numbers.append(member)
                continue
            self._steps.append(_Step(numbers, member))
            numbers = []
        if numbers:
            self._steps.append(_Step(numbers, None))
        if inside and not type_.members:
            self._steps.append(_Step([], None, "B"))

    def write(self, message: Any, body: bytearray) -> None:
        """Append the fields to `body`, which begins behind the encapsulation. Raises Unfit."""
        for step in self._steps:
            step.write(message, body)


class _Step:
    """Numbers, and the text, bytes or messages behind them, of which `write` puts the count with the numbers."""

    def __init__(self, numbers: Sequence[Member], tail: Member | None, filler: str = ""):
        codes = "".join(member.code for member in numbers) + filler + ("I" if tail else "")
        self._packers = [struct.Struct(_padded(codes, begin)).pack for begin in range(8)]
        self._numbers = _getter([member.attribute for member in numbers], (0,) if filler else ())
        self._tail = tail
        self._inner = Writer(tail.inner, inside=True) if tail and tail.inner else None

    def write(self, message: Any, body: bytearray) -> None:
        pack, numbers, tail = self._packers[len(body) & 7], self._numbers(message), self._tail
        if tail is None:
            body += pack(*numbers)
            return
        value = getattr(message, tail.attribute)
        if self._inner is not None and tail.inner is not None:
            found = [item for item in (value if tail.code == "L" else (value,)) if item is not None]
            body += pack(*numbers, len(found))
            for item in found:
                if "Inline" + type(item).__name__ != tail.inner.name.rpartition("/")[2]:
                    raise Unfit(f"{type(message).__name__}.{tail.attribute} holds {type(item).__name__}")
                self._inner.write(item, body)
        elif tail.code == "R":
            body += pack(*numbers, len(value)) + value
        else:
            data = (value if tail.code == "T" else json_text(value)).encode("utf-8", "replace")
            body += pack(*numbers, len(data) + 1) + data + b"\0"


def json_text(value: imc.Message | tuple[imc.Message | None, ...] | None) -> str:
    """A message inside another, or a list of them, as JSON: as `Message.to_json`, without header; "null" if none."""
    return json.dumps(_inside(value), ensure_ascii=False)


def _inside(value: imc.Message | tuple[imc.Message | None, ...] | None) -> Any:
    if isinstance(value, tuple):
        return [_inside(item) for item in value]
    if value is None:
        return None
    plain: dict[str, Any] = json.loads(value.to_json())
    return {name: item for name, item in plain.items() if name not in HEADER}


def _getter(names: Sequence[str], otherwise: tuple[int, ...]) -> Callable[[Any], Sequence[Any]]:
    if not names:
        return lambda _: otherwise
    if len(names) == 1:
        return lambda message: (getattr(message, names[0]),)
    return attrgetter(*names)


def _padded(codes: str, begin: int) -> str:
    """A struct format with the padding that CDR wants, for numbers that begin at such an offset (modulo 8)."""
    layout, place = "<", begin
    for code in codes:
        padding = -place % SIZES[code]
        layout += f"{padding}x" * bool(padding) + code
        place += padding + SIZES[code]
    return layout
