"""Finds the values of a message that do not fit the wire."""

import math
import reprlib
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, cast

from imc.layout import ADDRESS_FIELDS, TYPES_BY_CODE
from imc.message import Message, Unknown

INTEGERS = {"b": (-128, 127), "B": (0, 255), "h": (-32768, 32767), "H": (0, 65535)} | {
    "i": (-(2**31), 2**31 - 1),
    "I": (0, 2**32 - 1),
    "q": (-(2**63), 2**63 - 1),
}
"""Letter in `Message.WIRE` -> smallest and largest value."""
LARGEST_FP32 = 3.4028235677973366e38  # the first double that rounds beyond it
LARGEST_FP64 = 2**1024 - 2**970  # the same for integers


class Violation(NamedTuple):
    """A field (with its path inside the message, "maneuvers[0].data.speed"), its value, and what it should be.

    As text, a long value is cut: one that is a message may have megabytes, and the text goes into log books.
    """

    field: str
    value: object
    range: str

    def __str__(self) -> str:
        return f"{self.field}: {reprlib.repr(self.value)} is not {self.range}"


def encoding_violations(message: Message, wire: dict[str, str], path: str = "") -> Iterator[Violation]:
    """Values that cannot be written. wire: names of fields -> their letters in `Message.WIRE`."""
    for name, code in wire.items():
        expected = range_violation(getattr(message, name), code)
        if expected:
            yield Violation(path + name, getattr(message, name), expected)


def own_fields(message: Message) -> dict[str, str]:
    """Names of a message's own fields -> their letters in `Message.WIRE`."""
    names = message.__struct_fields__[len(ADDRESS_FIELDS) : -1]
    return dict(zip(names, message.WIRE, strict=True)) if message.WIRE else {}


def inner_messages(message: Message, path: str) -> Iterator[tuple[str, Message]]:
    """The messages in a message, with their paths."""
    for name, code in own_fields(message).items():
        value: Any = getattr(message, name)
        if code == "M" and isinstance(value, Message):
            yield f"{path}{name}", value
        elif code == "L" and isinstance(value, list | tuple):
            items = enumerate(cast(Sequence[Any], value))
            yield from ((f"{path}{name}[{index}]", item) for index, item in items if isinstance(item, Message))


def range_violation(value: Any, code: str) -> str:
    """Range that a value must be in to fit its letter in `Message.WIRE`; "" if it fits."""
    kind = TYPES_BY_CODE[code]
    if code in INTEGERS:
        low, high = INTEGERS[code]
        return "" if isinstance(value, int) and low <= value <= high else f"within {low} to {high} ({kind})"
    if code in "fd":
        if not isinstance(value, int | float):
            return f"a number ({kind})"
        largest = LARGEST_FP32 if code == "f" else LARGEST_FP64
        return f"within the range of {kind}" if largest <= abs(value) != math.inf else ""
    if code == "T":
        return _text_expectation(value)
    if code == "R":
        fits = isinstance(value, bytes | bytearray) and len(value) <= 0xFFFF
        return "" if fits else "bytes, 65535 at most (rawdata)"
    if code == "M":
        return "" if value is None or _is_known(value) else "a message or None"
    return (
        ""
        if isinstance(value, list | tuple) and _are_messages(cast(Sequence[Any], value))
        else "at most 65535 messages or None"
    )


def _text_expectation(value: Any) -> str:
    try:
        size = len(value.encode("utf-8", "surrogateescape"))
    except (AttributeError, UnicodeEncodeError):
        return "text that can be written (plaintext)"
    return "" if size <= 0xFFFF else "65535 bytes at most (plaintext)"


def _are_messages(items: Sequence[Any]) -> bool:
    return len(items) <= 0xFFFF and all(item is None or _is_known(item) for item in items)


def _is_known(value: Any) -> bool:
    return isinstance(value, Message) and not isinstance(value, Unknown)


def first_violation(message: Message, path: str = "") -> str:
    """The first value that cannot be written, in a message or those inside it; "" if there is none."""
    for violation in encoding_violations(message, own_fields(message), path):
        return str(violation)
    for inside, inner in inner_messages(message, path):
        problem = first_violation(inner, inside + ".")
        if problem:
            return problem
    return ""
