"""Writes a schema as IMC.xml, in the form that DUNE logs and that imcjava and Neptus read."""

from collections.abc import Iterator

from imc.layout import NUMPY, VARIABLE, WIRE_CODES
from imc.schema.definition import Enumeration, Field, MessageType
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


def dump(schema: Schema) -> bytes:
    """The schema as IMC.xml, UTF-8; `load` reads an equal schema from it."""
    return "".join(_document(schema)).encode("utf-8")


def _document(schema: Schema) -> Iterator[str]:
    yield '<?xml version="1.0" encoding="UTF-8"?>\n'
    yield _tag("messages", 0, ">", name=schema.name, long_name=schema.long_name, version=schema.version)
    sized = ((name, NUMPY[code][1:] if code in NUMPY else None) for name, code in WIRE_CODES.items())
    yield from _section("types", (_tag("type", 2, name=name, size=size) for name, size in sized))
    compound = (name for name, code in WIRE_CODES.items() if code in VARIABLE)
    yield from _section("serialization", (_tag("type", 2, name=name) for name in compound))
    yield from _section("units", (_tag("unit", 2, abbrev=unit.abbrev, name=unit.name) for unit in schema.units))
    yield from _section("enumerations", (_shared(shared, False) for shared in schema.enumerations))
    yield from _section("bitfields", (_shared(shared, True) for shared in schema.bitfields))
    yield "  <message-groups>\n"
    for group in schema.groups:
        yield _tag("message-group", 2, ">", name=group.name, abbrev=group.abbrev)
        yield from (_tag("message-type", 3, abbrev=member) for member in group.members)
        yield "    </message-group>\n"
    yield "  </message-groups>\n"
    yield from _section("flags", (_tag("flag", 2, abbrev=flag.abbrev, name=flag.name) for flag in schema.flags))
    yield _FRAME.format(sync=schema.sync)
    yield from _section("categories", (_tag("category", 2, name=name) for name in schema.categories))
    for message in schema.messages:
        yield from _message(message)
    yield "</messages>\n"


def _section(name: str, lines: Iterator[str]) -> Iterator[str]:
    yield f"  <{name}>\n"
    yield from lines
    yield f"  </{name}>\n"


def _shared(shared: Enumeration, bits: bool) -> str:
    head = _tag("def", 2, ">", name=shared.name, abbrev=shared.abbrev, prefix=shared.prefix)
    values = (
        _tag("value", 3, id=f"0x{value.id:02X}" if bits else str(value.id), name=value.name, abbrev=value.abbrev)
        for value in shared.values
    )
    return f"{head}{''.join(values)}    </def>\n"


def _message(message: MessageType) -> Iterator[str]:
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
    for field in message.fields:
        yield from _field(field)
    yield "  </message>\n"


def _field(field: Field) -> Iterator[str]:
    yield _tag(
        "field",
        2,
        ">" if field.values else "/>",
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
    if field.values:
        for value in field.values:
            number = f"0x{value.id:02X}" if field.is_bitfield and value.id >= 0 else str(value.id)
            yield _tag("value", 3, id=number, name=value.name, abbrev=value.abbrev)
        yield "    </field>\n"


def _tag(tag: str, depth: int, end: str = "/>", /, **attributes: str | None) -> str:
    text = "".join(f' {key.replace("_", "-")}="{_escape(value)}"' for key, value in attributes.items() if value)
    return f"{'  ' * depth}<{tag}{text}{end}\n"


def _number(value: int | float | None) -> str:
    return "" if value is None else repr(value)


def _escape(text: str) -> str:
    for character, entity in (("&", "&amp;"), ("<", "&lt;"), (">", "&gt;"), ('"', "&quot;"), ("\n", "&#10;")):
        text = text.replace(character, entity)
    return text.replace("\t", "&#9;").replace("\r", "&#13;")
