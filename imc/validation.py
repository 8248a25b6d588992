"""Checks the values of a message against the limits that the protocol gives for its fields."""

from collections.abc import Iterator
from typing import Any

from imc.encodability import Violation, encoding_violations, inner_messages, own_fields
from imc.layout import ADDRESS_FIELDS
from imc.message import Message
from imc.schema import FieldInfo, fields


def validate(message: Message) -> list[Violation]:
    """All values outside the limits of the protocol or of their wire type, in the message and those inside it.

    NaN is outside any limits. The codec does not call this: packets with such values are read, and written if the
    values fit their wire types.
    """
    return [*encoding_violations(message, ADDRESS_FIELDS), *_violations(message, "")]


def _violations(message: Message, path: str) -> Iterator[Violation]:
    wire = own_fields(message)
    unwritable = {violation.field for violation in encoding_violations(message, wire)}
    yield from encoding_violations(message, wire, path)
    infos = {info.name: info for info in fields(type(message))}
    for name in wire:
        value: Any = getattr(message, name)
        if name not in unwritable and isinstance(value, int | float):
            expected = _limit_expectation(value, infos[name])
            if expected:
                yield Violation(path + name, value, expected)
    for inside, inner in inner_messages(message, path):
        allowed = infos[inside[len(path) :].partition("[")[0]].messages
        if allowed and type(inner).__name__ not in allowed:
            yield Violation(inside, type(inner).__name__, f"one of {', '.join(sorted(allowed))}")
        yield from _violations(inner, inside + ".")


def _limit_expectation(value: int | float, info: FieldInfo) -> str:
    low, high = info.minimum, info.maximum
    if (low is None or value >= low) and (high is None or value <= high):
        return ""
    unit = f" {info.unit}" if info.unit and info.enum is None else ""
    if low is None:
        return f"at most {high}{unit}"
    return f"at least {low}{unit}" if high is None else f"within {low} to {high}{unit}"
