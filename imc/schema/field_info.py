"""Descriptions of the fields of a message class, for programs."""

from enum import IntEnum, IntFlag
from typing import Any, NamedTuple, TypeAlias

from imc import messages
from imc.message import Message
from imc.schema.definition import Field

Values: TypeAlias = type[IntEnum] | type[IntFlag]


class FieldInfo(NamedTuple):
    """A field: its attribute's name, wire type ("fp32_t"), unit ("" if none) and limits in that unit (None if none).

    enum: the IntEnum or IntFlag of its values. messages: names of the messages that it may carry; empty: any.
    """

    name: str
    type: str
    unit: str
    minimum: int | float | None
    maximum: int | float | None
    enum: Values | None
    messages: frozenset[str]


def field_info(cls: type[Message], field: Field, members: frozenset[str]) -> FieldInfo:
    """One field of a class; shared enumerations that are not nested in the class are those of `imc.messages`."""
    enum: Any = getattr(cls, field.enum_name, None) or getattr(messages, field.enum_def or field.bitfield_def, None)
    return FieldInfo(field.attribute, field.type, field.unit, field.minimum, field.maximum, enum, members)
