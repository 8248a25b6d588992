"""The definitions of a protocol version as values: messages, fields, enumerations, groups."""

import keyword
import re

import msgspec

from imc.errors import SchemaError
from imc.layout import WIRE_CODES

RESERVED = frozenset(
    {"abbrev", "timestamp", "src", "src_ent", "dst", "dst_ent", "surplus", "replace", "to_dict", "to_json"}
    | {"to_packet", "to_packet_with_header", "to_inline_little", "to_inline_big"}
)
"""Attributes that every message has."""

_IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


class Value(msgspec.Struct, frozen=True):
    """One named value of an enumeration, or bits of a bitfield."""

    id: int
    abbrev: str
    name: str

    @property
    def member_name(self) -> str:
        """Name of the Python enumeration member: the abbreviation, made an identifier."""
        text = re.sub(r"\W", "_", self.abbrev, flags=re.ASCII)
        if not text or text[0].isdigit() or text == "mro":
            text = "_" + text
        return text + "_" if keyword.iskeyword(text) else text


class Enumeration(msgspec.Struct, frozen=True):
    """A shared set of values, used by fields of several messages."""

    abbrev: str
    name: str
    prefix: str
    values: tuple[Value, ...]


class Field(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One field of a message, as the protocol defines it (limits are in its unit)."""

    abbrev: str
    name: str
    type: str
    unit: str = ""
    minimum: int | float | None = None
    maximum: int | float | None = None
    default: int | float | None = None
    prefix: str = ""
    values: tuple[Value, ...] = ()
    enum_def: str = ""
    bitfield_def: str = ""
    message_type: str = ""

    @property
    def attribute(self) -> str:
        """Name of the Python attribute: the abbreviation in lower case."""
        text = self.abbrev.lower()
        return text + "_" if keyword.iskeyword(text) or text in RESERVED else text

    @property
    def enum_name(self) -> str:
        """Name of the enumeration class nested in the message: the abbreviation in CamelCase."""
        text = "".join(part[0].upper() + part[1:] for part in self.abbrev.split("_") if part)
        return text + "_" if text.isupper() and len(text) > 1 else text

    @property
    def is_bitfield(self) -> bool:
        return self.unit == "Bitfield"


class MessageType(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One message of the protocol."""

    id: int
    abbrev: str
    name: str
    fields: tuple[Field, ...]
    category: str = ""
    source: tuple[str, ...] = ()
    flags: tuple[str, ...] = ()
    used_by: tuple[str, ...] = ()
    stable: bool = True
    replaces: str = ""

    @property
    def wire_codes(self) -> str:
        """The types of the fields, one letter each (`WIRE_CODES`)."""
        return "".join(WIRE_CODES[field.type] for field in self.fields)


class Group(msgspec.Struct, frozen=True):
    """A set of messages; a field may carry any of them."""

    abbrev: str
    name: str
    members: tuple[str, ...]


class NamedUnit(msgspec.Struct, frozen=True):
    """A unit, flag or category with its long name."""

    abbrev: str
    name: str


def check_messages(messages: tuple[MessageType, ...], places: dict[str, str]) -> None:
    """Raises SchemaError for ids or names used twice, unknown types, and names that cannot be used in Python.

    places: "Message" or "Message.field" -> "file:line".
    """
    ids: dict[int, str] = {}
    names: set[str] = set()
    for message in messages:
        where = places.get(message.abbrev, "")
        _check_name(message.abbrev, "message", where)
        if message.abbrev in names:
            raise SchemaError(f"message {message.abbrev} is defined twice", where)
        if not 0 <= message.id < 0xFFFF:
            raise SchemaError(f"{message.abbrev}: id {message.id} is not within 0 to 65534", where)
        if message.id in ids:
            raise SchemaError(f"{message.abbrev} and {ids[message.id]} have the same id {message.id}", where)
        names.add(message.abbrev)
        ids[message.id] = message.abbrev
        attributes: set[str] = set()
        for field in message.fields:
            label = f"{message.abbrev}.{field.abbrev}"
            where = places.get(label, "")
            _check_name(field.abbrev, f"field of {message.abbrev}", where)
            if field.attribute in attributes:
                raise SchemaError(f"field {label} is defined twice", where)
            attributes.add(field.attribute)
            if field.type not in WIRE_CODES:
                raise SchemaError(f"{label}: unknown type {field.type!r}", where)
            check_values(field.values, label, where)


def check_values(values: tuple[Value, ...], label: str, where: str) -> None:
    """Raises SchemaError if two values have the same name."""
    names: set[str] = set()
    for value in values:
        if value.member_name in names:
            raise SchemaError(f"{label}: value {value.abbrev} is defined twice", where)
        names.add(value.member_name)


def _check_name(text: str, what: str, where: str) -> None:
    if _IDENTIFIER.fullmatch(text) is None:
        raise SchemaError(f"{text!r} cannot name a {what}: letters, digits and underscores only", where)
