"""ROS 2 message types for the messages of an IMC schema, as text that rosidl, Foxglove and rosbags read."""

import re
from dataclasses import dataclass, field
from functools import cached_property

import imc
from imc.layout import WIRE_CODES

TYPES = {
    "int8_t": "int8",
    "uint8_t": "uint8",
    "int16_t": "int16",
    "uint16_t": "uint16",
    "int32_t": "int32",
    "uint32_t": "uint32",
    "int64_t": "int64",
    "fp32_t": "float32",
    "fp64_t": "float64",
    "plaintext": "string",
    "rawdata": "uint8[]",
}
PACKAGE = "imc_msgs"
SEPARATOR = "\n" + "=" * 80 + "\n"
ADDRESS = ("src", "src_ent", "dst", "dst_ent")

STANDARD = {
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec\n",
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id\n",
}


@dataclass(frozen=True)
class RosField:
    """A field of a ROS message: its name, its ROS type, the attribute and wire letter of its IMC field.

    inner: the type of the messages in the field; None if they are JSON text or there are none.
    """

    name: str
    type: str
    attribute: str
    code: str
    inner: "RosType | None" = None


@dataclass(frozen=True)
class RosType:
    """A ROS message type: "package/Name", its own definition, and the definitions that it needs."""

    name: str
    text: str
    fields: tuple[RosField, ...] = ()
    dependencies: dict[str, str] = field(default_factory=dict[str, str])

    @cached_property
    def full_name(self) -> str:
        """Name as in MCAP and ROS 2: "package/msg/Name"."""
        return self.name.replace("/", "/msg/")

    @cached_property
    def definition(self) -> str:
        """The definition with all that it needs, in ROS' concatenated form (encoding "ros2msg")."""
        parts = [self.text, *(f"MSG: {name}\n{text}" for name, text in self.dependencies.items())]
        return SEPARATOR.join(part.rstrip("\n") for part in parts) + "\n"


def ros_type(schema: imc.Schema, message: imc.MessageType) -> RosType:
    """The type imc_msgs/<Abbrev>: a std_msgs/Header, the addresses, then the fields in IMC's order and units.

    Text is string, raw data is uint8[]. An inline message is an array of at most one (empty: none) of the type
    imc_msgs/Inline<Abbrev>, if the protocol allows one type only; a list is an array of them without its empty places.
    Messages that may be of several types are JSON text, as `Message.to_json` writes it but without header
    ("null" if there is none).
    """
    members, lines, needs = _members(schema, message, frozenset({"header", *ADDRESS}), (message.abbrev,))
    head = [
        f"# {_comment(message.name)} (IMC {message.id})",
        "std_msgs/Header header",
        "uint16 src",
        "uint8 src_ent",
        "uint16 dst",
        "uint8 dst_ent",
    ]
    return RosType(_type_name(message.abbrev), "\n".join([*head, *lines]) + "\n", members, {**STANDARD, **needs})


def _inline_type(schema: imc.Schema, message: imc.MessageType, around: tuple[str, ...]) -> RosType:
    members, lines, needs = _members(schema, message, frozenset(), (*around, message.abbrev))
    head = f"# {_comment(message.name)} (IMC {message.id}) inside another message"
    # A message without fields would have no size, which ROS does not allow.
    lines = lines or ["uint8 structure_needs_at_least_one_member"]
    return RosType(_type_name("Inline" + message.abbrev), "\n".join([head, *lines]) + "\n", members, needs)


def _members(
    schema: imc.Schema, message: imc.MessageType, taken: frozenset[str], around: tuple[str, ...]
) -> tuple[tuple[RosField, ...], list[str], dict[str, str]]:
    members: list[RosField] = []
    lines: list[str] = []
    needs: dict[str, str] = {}
    names = set(taken)
    for field_ in message.fields:
        name = _field_name(field_.attribute, names)
        names.add(name)
        inner, note = None, ""
        if field_.type in TYPES:
            type_, code = TYPES[field_.type], WIRE_CODES[field_.type]
        else:
            allowed = schema.allowed_messages(field_.message_type)
            code = WIRE_CODES[field_.type]
            if len(allowed) == 1 and not allowed & set(around):
                inner = _inline_type(schema, schema.types[next(iter(allowed))], around)
                needs |= {inner.name: inner.text, **inner.dependencies}
                type_ = inner.name + ("[<=1]" if code == "M" else "[]")
            else:
                type_, note = "string", "JSON"
        lines += _constants(schema, field_, name, type_)
        unit = field_.unit if field_.unit not in ("Enumerated", "Bitfield", "TupleList", "List") else ""
        remark = ", ".join(text for text in (_comment(field_.name), unit, note) if text)
        lines.append(f"{type_} {name}" + (f"  # {remark}" if remark else ""))
        members.append(RosField(name, type_, field_.attribute, code, inner))
    return tuple(members), lines, needs


def _constants(schema: imc.Schema, field_: imc.Field, name: str, type_: str) -> list[str]:
    lines: list[str] = []
    taken: set[str] = set()
    for value in schema.values_of(field_) if "int" in type_ and "[" not in type_ else ():
        constant = _squeezed(f"{name}_{value.abbrev}").upper()
        if constant not in taken:
            taken.add(constant)
            lines.append(f"{type_} {constant}={value.id}")
    return lines


def _type_name(abbrev: str) -> str:
    name = abbrev.replace("_", "")
    return f"{PACKAGE}/{name[0].upper()}{name[1:]}"


def _field_name(attribute: str, taken: set[str]) -> str:
    name = _squeezed(attribute)
    while name in taken or not name[:1].isalpha():
        name = "imc_" + name
    return name


def _squeezed(name: str) -> str:
    """The name without double and trailing underscores, which ROS does not allow."""
    return re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_")


def _comment(text: str) -> str:
    return " ".join(text.replace("=", " ").split())
