"""Common Data Representation (plain CDR, little endian), the encoding of ROS 2 messages.

Source: OMG DDS-XTypes 1.3, 7.4.1 (XCDR version 1): numbers are aligned to their size, counted from after the
four encapsulation bytes; a string begins with its length, which counts the NUL at its end.
"""

import json
import struct
from collections.abc import Callable, Iterable, Sequence
from operator import attrgetter
from typing import Any

import numpy as np

import imc
from imc.layout import ADDRESS_FIELDS, NUMPY, VARIABLE
from runtime.logs import Array
from shoal.logs.export.ros_types import RosField, RosType

ENCAPSULATION = b"\0\1\0\0"
SIZES = {code: struct.calcsize("<" + code) for code in NUMPY}

Item = tuple[str, str] | tuple[str, str, int] | bytes


class CdrRecords:
    """Records of fixed size as a NumPy array: the unaligned `prefix`, then aligned numbers and constant texts.

    items: (name, struct letter), (name, letter, count) or the bytes of a constant text.
    """

    def __init__(self, prefix: Sequence[tuple[str, str]], items: Iterable[Item]):
        names, formats, offsets = [name for name, _ in prefix], ["<" + NUMPY[code] for _, code in prefix], list[int]()
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
                template += cdr_string(item)
                continue
            count = item[2] if len(item) == 3 else 1
            names.append(item[0])
            formats.append(f"<{NUMPY[code]}" if len(item) == 2 else f"{count}<{NUMPY[code]}")
            offsets.append(len(template))
            template += bytes(count * SIZES[code])
        self.size: int = len(template)
        self.data_size: int = self.size - place
        self._template = bytes(template)
        self._dtype = np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": self.size})

    def zeros(self, count: int) -> Array:
        """`count` records, all numbers zero."""
        return np.frombuffer(bytearray(self._template * count), self._dtype)


def cdr_string(data: bytes) -> bytes:
    """A string with its length; it must be placed at a multiple of four."""
    return struct.pack("<I", len(data) + 1) + data + b"\0"


class CdrError(ValueError):
    """A message that its ROS type cannot hold; the text gives the reason."""


CdrWriter = Callable[[Any, bytearray], None]
"""Appends the fields of a message to a body that begins after the encapsulation. Raises CdrError."""


def make_cdr_writer(type_: RosType, inside: bool = False) -> CdrWriter:
    """A function that writes messages of one type; `inside` another message, ROS needs at least one byte."""
    steps: list[CdrWriter] = []
    numbers: list[RosField] = []
    for member in type_.fields:
        numbers.append(member)
        if member.code in VARIABLE:
            steps.append(_step(numbers[:-1], member))
            numbers = []
    if numbers:
        steps.append(_numbers(numbers))
    if not type_.fields and inside:
        return lambda _, body: body.append(0)
    if len(steps) == 1:
        return steps[0]

    def write(message: Any, body: bytearray) -> None:
        for step in steps:
            step(message, body)

    return write


def _numbers(members: Sequence[RosField]) -> CdrWriter:
    packers, values = _packers("".join(member.code for member in members)), _getter(members)

    def write(message: Any, body: bytearray) -> None:
        body += packers[len(body) & 7](*values(message))

    return write


def _step(members: Sequence[RosField], tail: RosField) -> CdrWriter:
    """Writes numbers and the text, bytes or messages after them, whose count is packed with the numbers."""
    packers, values = _packers("".join(member.code for member in members) + "I"), _getter(members)
    name, code, inner = tail.attribute, tail.code, tail.inner
    if inner is not None:
        return _messages(packers, values, tail, inner)

    def write_bytes(message: Any, body: bytearray) -> None:
        data = getattr(message, name)
        body += packers[len(body) & 7](*values(message), len(data)) + data

    def write_text(message: Any, body: bytearray) -> None:
        data = getattr(message, name).encode("utf-8", "replace")
        body += packers[len(body) & 7](*values(message), len(data) + 1) + data + b"\0"

    def write_json(message: Any, body: bytearray) -> None:
        data = json_text(getattr(message, name)).encode("utf-8", "replace")
        body += packers[len(body) & 7](*values(message), len(data) + 1) + data + b"\0"

    return {"R": write_bytes, "T": write_text}.get(code, write_json)


def _messages(packers: "Sequence[_Pack]", values: "_Values", tail: RosField, inner: RosType) -> CdrWriter:
    write_inner, name = make_cdr_writer(inner, inside=True), tail.attribute
    expected = inner.name.rpartition("/")[2]

    def write(message: Any, body: bytearray) -> None:
        value = getattr(message, name)
        found = [item for item in (value if tail.code == "L" else (value,)) if item is not None]
        body += packers[len(body) & 7](*values(message), len(found))
        for item in found:
            if "Inline" + type(item).__name__.replace("_", "") != expected:
                raise CdrError(f"{type(message).__name__}.{name} holds {type(item).__name__}")
            write_inner(item, body)

    return write


def json_text(value: imc.Message | tuple[imc.Message | None, ...] | None) -> str:
    """A message inside another, or a list of them, as JSON: as `Message.to_json`, without header; "null" if none."""
    return json.dumps(_inside(value), ensure_ascii=False)


def _inside(value: imc.Message | tuple[imc.Message | None, ...] | None) -> Any:
    if isinstance(value, tuple):
        return [_inside(item) for item in value]
    if value is None:
        return None
    plain: dict[str, Any] = json.loads(value.to_json())
    return {name: item for name, item in plain.items() if name not in ADDRESS_FIELDS}


_Pack = Callable[..., bytes]
_Values = Callable[[Any], Sequence[Any]]


def _getter(members: Sequence[RosField]) -> _Values:
    names = [member.attribute for member in members]
    if not names:
        return lambda _: ()
    if len(names) == 1:
        return lambda message: (getattr(message, names[0]),)
    return attrgetter(*names)


def _packers(codes: str) -> Sequence[_Pack]:
    """Packers of these numbers, one for each offset modulo 8 at which they may begin."""
    return [struct.Struct(_padded(codes, begin)).pack for begin in range(8)]


def _padded(codes: str, begin: int) -> str:
    """A struct format with the padding of CDR, for numbers that begin at this offset modulo 8."""
    layout, place = "<", begin
    for code in codes:
        padding = -place % SIZES[code]
        layout += f"{padding}x" * bool(padding) + code
        place += padding + SIZES[code]
    return layout
