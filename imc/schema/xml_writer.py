"""Writes a schema as IMC.xml, in the form that DUNE logs and that imcjava and Neptus read."""

from collections.abc import Iterator

from imc.layout import NUMPY, VARIABLE, WIRE_CODES
from imc.schema.definition import Enumeration, Field, MessageType, NamedUnit, Value
from imc.schema.schema import Schema

_FRAME = """\
  <header>
    <field name="Synchronization Number" abbrev="sync" type="uint16_t" value="0x{sync:04X}" fixed="true"/>
    <field name="Message Identification Number" abbrev="mgid" type="uint16_t"/>
    <field name="Message size" abbrev="size" type="uint16_t" unit="byte"/>
    <field name="Time stamp" abbrev="timestamp" type="fp64_t" unit="s"/>
    <field name="Source Address" abbrev="src" type="uint16_t"/>
    <field name="Source Entity" abbrev="src_ent" type="uint8_t"/>
    <field name="Destination Address" abbrev="dst" type="uint16_t"/>
    <field name="Destination Entity" abbrev="dst_ent" type="uint8_t"/>
  </header>
  <footer>
    <field name="Check Sum (CRC-16-IBM)" abbrev="crc16" type="uint16_t"/>
  </footer>
"""


# Not by xml.sax.saxutils, which imports urllib.request, and with that ssl, http and email: 5 % of a start.
_IN_TEXT = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;", "\r": "&#13;"})
_IN_ATTRIBUTE = {**_IN_TEXT, **str.maketrans({'"': "&quot;", "\n": "&#10;", "\t": "&#9;"})}

Descriptions = dict[tuple[str, ...], str]


def dump(schema: Schema) -> bytes:
    """The schema as IMC.xml, UTF-8; `load` reads an equal schema, with the same descriptions, from it."""
    return "".join(_document(schema)).encode("utf-8")


def _document(schema: Schema) -> Iterator[str]:
    described = schema.descriptions
    yield '<?xml version="1.0" encoding="UTF-8"?>\n'
    yield _tag("messages", 0, ">", name=schema.name, long_name=schema.long_name, version=schema.version)
    yield _description(described.get(()), 1)
    sized = ((name, NUMPY[code][1:] if code in NUMPY else None) for name, code in WIRE_CODES.items())
    yield from _section("types", (_tag("type", 2, name=name, size=size) for name, size in sized))
    compound = (name for name, code in WIRE_CODES.items() if code in VARIABLE)
    yield from _section("serialization", (_tag("type", 2, name=name) for name in compound))
    yield from _section("units", _named(described, "units", "unit", schema.units))
    yield from _section("enumerations", (_shared(described, "enumerations", shared) for shared in schema.enumerations))
    yield from _section("bitfields", (_shared(described, "bitfields", shared) for shared in schema.bitfields))
    yield "  <message-groups>\n"
    for group in schema.groups:
        yield _tag("message-group", 2, ">", name=group.name, abbrev=group.abbrev)
        yield _description(described.get(("groups", group.abbrev)), 3)
        yield from (_tag("message-type", 3, abbrev=member) for member in group.members)
        yield "    </message-group>\n"
    yield "  </message-groups>\n"
    yield from _section("flags", _named(described, "flags", "flag", schema.flags))
    yield _FRAME.format(sync=schema.sync)
    categories = (_element("category", 2, described.get(("categories", name)), name=name) for name in schema.categories)
    yield from _section("categories", categories)
    for message in schema.messages:
        yield from _message(message, described)
    yield "</messages>\n"


def _section(name: str, lines: Iterator[str]) -> Iterator[str]:
    yield f"  <{name}>\n"
    yield from lines
    yield f"  </{name}>\n"


def _named(described: Descriptions, section: str, tag: str, all_of: tuple[NamedUnit, ...]) -> Iterator[str]:
    for one in all_of:
        yield _element(tag, 2, described.get((section, one.abbrev)), abbrev=one.abbrev, name=one.name)


def _shared(described: Descriptions, section: str, shared: Enumeration) -> str:
    head = _tag("def", 2, ">", name=shared.name, abbrev=shared.abbrev, prefix=shared.prefix)
    path = section, shared.abbrev
    values = _values(shared.values, section == "bitfields", path, described)
    return f"{head}{_description(described.get(path), 3)}{values}    </def>\n"


def _values(values: tuple[Value, ...], bits: bool, path: tuple[str, ...], described: Descriptions) -> str:
    return "".join(
        _element(
            "value",
            3,
            described.get((*path, value.abbrev)),
            id=f"0x{value.id:02X}" if bits and value.id >= 0 else str(value.id),
            name=value.name,
            abbrev=value.abbrev,
        )
        for value in values
    )


def _message(message: MessageType, described: Descriptions) -> Iterator[str]:
    yield _tag(
        "message",
        1,
        ">",
        id=str(message.id),
        name=message.name,
        abbrev=message.abbrev,
        source=",".join(message.source),
        used_by=",".join(message.used_by),
        flags=",".join(message.flags),
        stable="" if message.stable else "false",
        category=message.category,
    )
    yield _description(described.get(("messages", message.abbrev)), 2)
    for field in message.fields:
        yield _field(field, ("messages", message.abbrev, field.abbrev), described)
    yield "  </message>\n"


def _field(field: Field, path: tuple[str, ...], described: Descriptions) -> str:
    return _element(
        "field",
        2,
        described.get(path),
        _values(field.values, field.is_bitfield, path, described),
        name=field.name,
        abbrev=field.abbrev,
        type=field.type,
        unit=field.unit,
        min=_number(field.minimum),
        max=_number(field.maximum),
        value=_number(field.default),
        prefix=field.prefix,
        enum_def=field.enum_def,
        bitfield_def=field.bitfield_def,
        message_type=field.message_type,
    )


def _element(tag: str, depth: int, description: str | None, inner: str = "", /, **attributes: str | None) -> str:
    inner = _description(description, depth + 1) + inner
    if not inner:
        return _tag(tag, depth, **attributes)
    return f"{_tag(tag, depth, '>', **attributes)}{inner}{'  ' * depth}</{tag}>\n"


def _description(text: str | None, depth: int) -> str:
    return f"{'  ' * depth}<description>{text.translate(_IN_TEXT)}</description>\n" if text else ""


def _tag(tag: str, depth: int, end: str = "/>", /, **attributes: str | None) -> str:
    text = "".join(
        f' {key.replace("_", "-")}="{value.translate(_IN_ATTRIBUTE)}"' for key, value in attributes.items() if value
    )
    return f"{'  ' * depth}<{tag}{text}{end}\n"


def _number(value: int | float | None) -> str:
    return "" if value is None else repr(value)
