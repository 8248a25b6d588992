"""Reads protocol definitions from an IMC.xml."""

from collections.abc import Iterator

from imc.errors import SchemaError
from imc.layout import NUMBERS, SYNC
from imc.schema.definition import Enumeration, Field, Group, MessageType, NamedUnit, Value
from imc.schema.schema import Schema
from support.located_xml import Element, parse_xml_tree
from support.number_parsing import parse_number

HEADER_LAYOUT = (
    ("sync", "uint16_t"),
    ("mgid", "uint16_t"),
    ("size", "uint16_t"),
    ("timestamp", "fp64_t"),
    ("src", "uint16_t"),
    ("src_ent", "uint8_t"),
    ("dst", "uint16_t"),
    ("dst_ent", "uint8_t"),
)
FOOTER_LAYOUT = (("crc16", "uint16_t"),)
DESCRIBED = (
    ("units", "units", "unit"),
    ("enumerations", "enumerations", "def"),
    ("bitfields", "bitfields", "def"),
    ("groups", "message-groups", "message-group"),
    ("flags", "flags", "flag"),
    ("categories", "categories", "category"),
    ("messages", "message"),
)
"""Parts of a schema whose definitions may have a description, and the tags that lead there."""


def read_xml(data: bytes, file: str) -> tuple[Schema, dict[str, str]]:
    """The schema in an XML text, and the places of its messages and fields. Raises SchemaError naming file:line."""
    root = parse_xml_tree(data, file, SchemaError)
    if root.tag != "messages":
        raise SchemaError(f"expected <messages>, not <{root.tag}>", root.where)
    places: dict[str, str] = {}
    name = root.require("name")
    schema = Schema(
        name=name,
        long_name=root.get("long-name") or name,
        version=root.require("version"),
        sync=_header(root),
        units=_named(root.descendants_at_path("units", "unit")),
        enumerations=_shared(root.descendants_at_path("enumerations", "def")),
        bitfields=_shared(root.descendants_at_path("bitfields", "def")),
        groups=_groups(root),
        flags=_named(root.descendants_at_path("flags", "flag")),
        categories=tuple(element.require("name") for element in root.descendants_at_path("categories", "category")),
        messages=tuple(_message(element, places) for element in root.descendants_at_path("message")),
    )
    schema.descriptions.update(_descriptions(root))
    return schema, places


def _descriptions(root: Element) -> Iterator[tuple[tuple[str, ...], str]]:
    """The descriptions, by the path of their definitions (see `Schema.descriptions`)."""
    found: list[tuple[tuple[str, ...], Element]] = [((), root)]
    for section, *tags in DESCRIBED:
        for element in root.descendants_at_path(*tags):
            path = section, element.get("abbrev") or element.get("name")
            found.append((path, element))
            for inner in (*element.descendants_at_path("field"), *element.descendants_at_path("value")):
                found.append(((*path, inner.get("abbrev")), inner))
                found += (
                    ((*path, inner.get("abbrev"), v.get("abbrev")), v) for v in inner.descendants_at_path("value")
                )
    for path, element in found:
        if element.description_text:
            yield path, element.description_text


def _header(root: Element) -> int:
    sync = SYNC
    for tag, layout in (("header", HEADER_LAYOUT), ("footer", FOOTER_LAYOUT)):
        for element in root.descendants_at_path(tag):
            fields = element.descendants_at_path("field")
            if tuple((field.get("abbrev"), field.get("type")) for field in fields) != layout:
                raise SchemaError(f"the {tag} differs from that of IMC 5", element.where)
            if fields[0].get("value"):
                sync = _integer(fields[0], "value")
    return sync


def _named(elements: list[Element]) -> tuple[NamedUnit, ...]:
    return tuple(NamedUnit(element.require("abbrev"), element.get("name")) for element in elements)


def _shared(elements: list[Element]) -> tuple[Enumeration, ...]:
    return tuple(
        Enumeration(
            element.require("abbrev"),
            element.get("name") or element.get("abbrev"),
            element.get("prefix"),
            _values(element),
        )
        for element in elements
    )


def _groups(root: Element) -> tuple[Group, ...]:
    return tuple(
        Group(
            element.require("abbrev"),
            element.get("name") or element.get("abbrev"),
            tuple(member.require("abbrev") for member in element.descendants_at_path("message-type")),
        )
        for element in root.descendants_at_path("message-groups", "message-group")
    )


def _values(element: Element) -> tuple[Value, ...]:
    return tuple(
        Value(_integer(value, "id"), value.require("abbrev"), value.get("name") or value.get("abbrev"))
        for value in element.descendants_at_path("value")
    )


def _message(element: Element, places: dict[str, str]) -> MessageType:
    abbrev = element.require("abbrev")
    places.setdefault(abbrev, element.where)
    return MessageType(
        id=_integer(element, "id"),
        abbrev=abbrev,
        name=element.get("name") or abbrev,
        category=element.get("category"),
        source=element.attribute_words("source"),
        flags=element.attribute_words("flags"),
        used_by=element.attribute_words("used-by"),
        stable=element.get("stable", "true") != "false",
        fields=tuple(_field(abbrev, field, places) for field in element.descendants_at_path("field")),
    )


def _field(message: str, element: Element, places: dict[str, str]) -> Field:
    abbrev = element.require("abbrev")
    kind = element.require("type")
    places[f"{message}.{abbrev}"] = element.where
    return Field(
        abbrev=abbrev,
        name=element.get("name") or abbrev,
        type=kind,
        unit=element.get("unit"),
        minimum=_number(element, "min"),
        maximum=_number(element, "max"),
        default=_number(element, "value") if kind in NUMBERS else None,
        prefix=element.get("prefix"),
        values=_values(element),
        enum_def=element.get("enum-def"),
        bitfield_def=element.get("bitfield-def"),
        message_type=element.get("message-type"),
    )


def _number(element: Element, name: str) -> int | float | None:
    text = element.get(name).strip()
    return _parsed(text, element) if text else None


def _integer(element: Element, name: str) -> int:
    number = _parsed(element.require(name).strip(), element)
    if not isinstance(number, int):
        raise SchemaError(f"{name!r} of <{element.tag}> is not an integer", element.where)
    return number


def _parsed(text: str, element: Element) -> int | float:
    try:
        return parse_number(text)
    except ValueError as wrong:
        raise SchemaError(str(wrong), element.where) from None
