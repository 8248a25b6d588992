"""Reads protocol definitions in Shoal's YAML layout."""

from imc.errors import SchemaError
from imc.layout import SYNC
from imc.schema.definition import Enumeration, Field, Group, MessageType, NamedUnit, Value
from imc.schema.schema import Schema
from support.located_yaml import Node, parse_yaml_tree

_TOP = ("name", "long_name", "version", "sync", "units", "enumerations", "bitfields", "groups", "flags", "categories")
_MESSAGE = ("id", "name", "category", "source", "flags", "used_by", "stable", "replaces", "description", "fields")
_FIELD = ("type", "name", "unit", "min", "max", "default", "prefix", "enum", "bits", "values", "message", "description")


def read_yaml(text: str, file: str) -> tuple[Schema, dict[str, str]]:
    """The schema in a YAML text, and the file:line of each message and field. Raises SchemaError naming file:line."""
    top = parse_yaml_tree(text, file, SchemaError).mapping(*_TOP, "messages", required=("name", "version", "messages"))
    name = top["name"].text()
    places: dict[str, str] = {}
    described: dict[tuple[str, ...], str] = {}
    messages = tuple(_message(abbrev, node, places, described) for abbrev, node in top["messages"].mapping().items())
    categories = top["categories"].texts() if "categories" in top else ()
    schema = Schema(
        name=name,
        long_name=top["long_name"].text() if "long_name" in top else name,
        version=top["version"].text(),
        sync=top["sync"].integer() if "sync" in top else SYNC,
        units=_named(top.get("units")),
        enumerations=_shared(top.get("enumerations")),
        bitfields=_shared(top.get("bitfields")),
        groups=_groups(top.get("groups")),
        flags=_named(top.get("flags")),
        categories=categories,
        messages=messages,
    )
    schema.descriptions.update(described)
    return schema, places


def _named(node: Node | None) -> tuple[NamedUnit, ...]:
    return tuple(NamedUnit(abbrev, name.text()) for abbrev, name in node.mapping().items()) if node else ()


def _shared(node: Node | None) -> tuple[Enumeration, ...]:
    if node is None:
        return ()
    found: list[Enumeration] = []
    for abbrev, definition in node.mapping().items():
        keys = definition.mapping("name", "prefix", "values", required=("name", "values"))
        prefix = keys["prefix"].text() if "prefix" in keys else ""
        found.append(Enumeration(abbrev, keys["name"].text(), prefix, _values(keys["values"])))
    return tuple(found)


def _groups(node: Node | None) -> tuple[Group, ...]:
    if node is None:
        return ()
    found: list[Group] = []
    for abbrev, group in node.mapping().items():
        keys = group.mapping("name", "members", required=("name", "members"))
        found.append(Group(abbrev, keys["name"].text(), keys["members"].texts()))
    return tuple(found)


def _values(node: Node) -> tuple[Value, ...]:
    found: list[Value] = []
    for number, abbrev in node.mapping().items():
        text = abbrev.text()
        found.append(Value(Node(number, abbrev.file, abbrev.line, SchemaError).integer(), text, text))
    return tuple(found)


def _message(abbrev: str, node: Node, places: dict[str, str], described: dict[tuple[str, ...], str]) -> MessageType:
    keys = node.mapping(*_MESSAGE, required=("id", "name"))
    places[abbrev] = node.where
    fields = keys["fields"].mapping() if "fields" in keys else {}
    places.update((f"{abbrev}.{name}", field.where) for name, field in fields.items())
    for path, known in ((), keys), *(((name,), field.mapping()) for name, field in fields.items()):
        if "description" in known:
            described["messages", abbrev, *path] = known["description"].text()
    return MessageType(
        id=keys["id"].integer(),
        abbrev=abbrev,
        name=keys["name"].text(),
        category=keys["category"].text() if "category" in keys else "",
        source=keys["source"].texts() if "source" in keys else (),
        flags=keys["flags"].texts() if "flags" in keys else (),
        used_by=keys["used_by"].texts() if "used_by" in keys else (),
        stable=keys["stable"].flag() if "stable" in keys else True,
        replaces=keys["replaces"].text() if "replaces" in keys else "",
        fields=tuple(_field(name, field) for name, field in fields.items()),
    )


def _field(abbrev: str, node: Node) -> Field:
    keys = node.mapping(*_FIELD, required=("type", "name"))
    unit = "Enumerated" if "enum" in keys else "Bitfield" if "bits" in keys else ""
    values: tuple[Value, ...] = _values(keys["values"]) if "values" in keys else ()
    shared = {"enum": "", "bits": ""}
    for key in shared:
        if key in keys:
            if isinstance(keys[key].content, str):
                shared[key] = keys[key].text()
            else:
                values = _values(keys[key])
    return Field(
        abbrev=abbrev,
        name=keys["name"].text(),
        type=keys["type"].text(),
        unit=keys["unit"].text() if "unit" in keys else unit,
        minimum=keys["min"].number() if "min" in keys else None,
        maximum=keys["max"].number() if "max" in keys else None,
        default=keys["default"].number() if "default" in keys else None,
        prefix=keys["prefix"].text() if "prefix" in keys else "",
        values=values,
        enum_def=shared["enum"],
        bitfield_def=shared["bits"],
        message_type=keys["message"].text() if "message" in keys else "",
    )
