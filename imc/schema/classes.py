"""Message classes made at run time from definitions."""

import sys
from enum import IntEnum, IntFlag
from typing import TYPE_CHECKING, Any, cast
from zlib import crc32

import msgspec

from imc.message import Message, MessageWithLists
from imc.schema.definition import MessageType, Value

if TYPE_CHECKING:
    from imc.schema.schema import Schema

DEFAULTS: dict[str, tuple[Any, Any]] = {
    "f": (float, 0.0),
    "d": (float, 0.0),
    "T": (str, ""),
    "R": (bytes, b""),
    "M": (Message | None, None),
    "L": (tuple[Message | None, ...], ()),
}
"""Letter in `Message.WIRE` -> Python type and default; the other letters are int, 0."""


def build_class(definition: MessageType, schema: "Schema") -> type[Message]:
    """A class like those in `imc.messages`; shared enumerations are nested in it as well."""
    wire = definition.wire_codes
    lists = tuple(field.attribute for field, code in zip(definition.fields, wire, strict=True) if code == "L")
    namespace: dict[str, Any] = {"ID": definition.id, "WIRE": wire, "SYNC": schema.sync, "SCHEMA": schema}
    namespace["__doc__"] = f"{definition.name}."
    if lists:
        namespace["LISTS"] = lists
    for field in definition.fields:
        values = schema.values_of(field)
        if values:
            namespace[field.enum_name] = build_enum(field.enum_name, values, field.is_bitfield)
    fields = [
        (sys.intern(field.attribute), *DEFAULTS.get(code, (int, 0)))
        for field, code in zip(definition.fields, wire, strict=True)
    ]
    base = MessageWithLists if lists else Message
    cls = msgspec.defstruct(definition.abbrev, fields, bases=(base,), namespace=namespace, frozen=True, gc=False)
    return cast(type[Message], cls)


def definition_checksum(kind: type[Message]) -> str:
    """Eight hexadecimal digits that are the same where a message has the same id, name and fields."""
    return f"{crc32(' '.join((str(kind.ID), kind.__name__, kind.WIRE, *kind.__struct_fields__)).encode()):08x}"


def build_enum(name: str, values: tuple[Value, ...], bits: bool) -> type[IntEnum] | type[IntFlag]:
    """An IntEnum, or an IntFlag for a bitfield."""
    members = [(value.member_name, value.id) for value in values]
    return cast(type[IntFlag], IntFlag(name, members)) if bits else cast(type[IntEnum], IntEnum(name, members))
