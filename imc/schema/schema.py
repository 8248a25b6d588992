"""A version of the protocol as a value, with its message classes and its codec."""

from functools import cached_property
from typing import TypeVar

import msgspec

from imc.codec import ByteOrder, Codec, encode
from imc.errors import SchemaError
from imc.layout import SYNC
from imc.message import Message
from imc.schema.classes import build_class
from imc.schema.definition import (
    Enumeration,
    Field,
    Group,
    MessageType,
    NamedUnit,
    Value,
    check_messages,
    check_values,
)
from imc.schema.field_info import FieldInfo, field_info

T = TypeVar("T", NamedUnit, Enumeration)


class Schema(msgspec.Struct, frozen=True, kw_only=True, dict=True, omit_defaults=True):
    """Definitions of messages. Schemas with the same definitions are equal; none affects another."""

    name: str
    version: str
    long_name: str = ""
    sync: int = SYNC
    units: tuple[NamedUnit, ...] = ()
    enumerations: tuple[Enumeration, ...] = ()
    bitfields: tuple[Enumeration, ...] = ()
    groups: tuple[Group, ...] = ()
    flags: tuple[NamedUnit, ...] = ()
    categories: tuple[str, ...] = ()
    messages: tuple[MessageType, ...] = ()

    def __getitem__(self, abbrev: str) -> type[Message]:
        """The class of a message, by its name. Raises KeyError."""
        return self.by_id(self.types[abbrev].id)

    def __contains__(self, abbrev: object) -> bool:
        return abbrev in self.types

    def by_id(self, id: int) -> type[Message]:
        """The class of a message, by its id. Raises KeyError."""
        found = self._classes.get(id)
        if found is None:
            found = self._classes[id] = build_class(self.types_by_id[id], self)
        return found

    @cached_property
    def types(self) -> dict[str, MessageType]:
        """Definitions of the messages, by name."""
        return {message.abbrev: message for message in self.messages}

    @cached_property
    def types_by_id(self) -> dict[int, MessageType]:
        """Definitions of the messages, by id."""
        return {message.id: message for message in self.messages}

    @cached_property
    def descriptions(self) -> dict[tuple[str, ...], str]:
        """Texts that explain definitions, by their path: ("messages", "Abort"), ("enumerations", "Side", "PORT") ...

        A field and its values follow the name of their message; () is the schema. Schemas that differ only here are
        equal.
        """
        return {}

    @cached_property
    def codec(self) -> Codec:
        """Reads and writes packets of this schema."""
        return Codec(self.by_id, self.sync)

    def decode(self, packet: bytes) -> Message:
        """The message in a packet: like `imc.decode`, with this schema's classes. Raises DecodeError."""
        return self.codec.decode(packet)

    def encode(self, message: Message, byteorder: ByteOrder = "little") -> bytes:
        """The packet of a message of this schema, like `imc.encode`. Raises EncodeError."""
        return encode(message, byteorder)

    def fields(self, cls: type[Message]) -> tuple[FieldInfo, ...]:
        """The fields of a class of this schema, like `imc.fields`."""
        found = self._infos.get(cls.ID)
        if found is None:
            fields = self.types_by_id[cls.ID].fields
            found = self._infos[cls.ID] = tuple(
                field_info(cls, field, self.allowed_messages(field.message_type)) for field in fields
            )
        return found

    def values_of(self, field: Field) -> tuple[Value, ...]:
        """The named values of an enumerated field or bitfield: its own, or the shared set it refers to."""
        for name, shared in ((field.enum_def, self.enumerations), (field.bitfield_def, self.bitfields)):
            for definition in shared:
                if definition.abbrev == name:
                    return definition.values
        return field.values

    def allowed_messages(self, name: str) -> frozenset[str]:
        """Names of the messages that a field restricted to this message or group may carry; empty: any."""
        for group in self.groups:
            if group.abbrev == name:
                return frozenset(group.members)
        return frozenset((name,)) if name else frozenset()

    def overlay(self, other: "Schema", places: dict[str, str] | None = None) -> "Schema":
        """This schema extended by the definitions of another.

        A message of `other` with the id or name of a message here must name that one in `replaces`; otherwise
        SchemaError names both, and the place of the message if given ("Message" -> "file:line").
        """
        messages = {message.abbrev: message for message in self.messages}
        order = list(messages)
        for message in other.messages:
            if messages.get(message.abbrev) == message:
                continue
            where = places[message.abbrev] if places else ""
            if message.replaces:
                if message.replaces not in messages:
                    raise SchemaError(f"{message.abbrev} replaces {message.replaces}, which is not defined", where)
                order[order.index(message.replaces)] = message.abbrev
                del messages[message.replaces]
            else:
                order.append(message.abbrev)
            for old in messages.values():
                if message.id == old.id or message.abbrev == old.abbrev:
                    raise SchemaError(
                        f"{message.abbrev} (id {message.id}) collides with {old.abbrev} (id {old.id}); "
                        f"if intended, add `replaces: {old.abbrev}`",
                        where,
                    )
            messages[message.abbrev] = msgspec.structs.replace(message, replaces="")
        groups = {group.abbrev: group for group in self.groups}
        for group in other.groups:
            members = groups[group.abbrev].members if group.abbrev in groups else ()
            groups[group.abbrev] = Group(group.abbrev, group.name, (*members, *group.members))
        merged = msgspec.structs.replace(
            self,
            units=_union(self.units, other.units),
            enumerations=_union(self.enumerations, other.enumerations),
            bitfields=_union(self.bitfields, other.bitfields),
            flags=_union(self.flags, other.flags),
            groups=tuple(
                Group(group.abbrev, group.name, tuple(name for name in group.members if name in messages))
                for group in groups.values()
            ),
            categories=tuple(dict.fromkeys((*self.categories, *other.categories))),
            messages=tuple(messages[abbrev] for abbrev in order),
        )
        merged.descriptions.update(self.descriptions | other.descriptions)
        return merged

    def check(self, places: dict[str, str]) -> None:
        """Raises SchemaError for definitions that conflict or refer to undefined names.

        places: "Message" and "Message.field" -> "file:line".
        """
        check_messages(self.messages, places)
        for shared in (*self.enumerations, *self.bitfields):
            check_values(shared.values, shared.abbrev, places.get(shared.abbrev, ""))
        enumerations = {shared.abbrev for shared in self.enumerations}
        bitfields = {shared.abbrev for shared in self.bitfields}
        carried = {group.abbrev for group in self.groups} | set(self.types)
        for message in self.messages:
            for field in message.fields:
                for name, names in (
                    (field.enum_def, enumerations),
                    (field.bitfield_def, bitfields),
                    (field.message_type, carried),
                ):
                    if name and name not in names:
                        label = f"{message.abbrev}.{field.abbrev}"
                        raise SchemaError(f"{label}: {name} is not defined", places.get(label, ""))

    def use_classes(self, classes: dict[int, type[Message]]) -> None:
        """Use these classes, by id, instead of building new ones."""
        self._classes.update(classes)

    def share_classes(self, other: "Schema") -> None:
        """Use the classes of another schema for the messages that both define in the same way."""
        for message in other.messages:
            if self.types_by_id.get(message.id) == message and all(
                self.values_of(field) == other.values_of(field) for field in message.fields
            ):
                self._classes[message.id] = other.by_id(message.id)

    @cached_property
    def _infos(self) -> dict[int, tuple[FieldInfo, ...]]:
        return {}

    @cached_property
    def _classes(self) -> dict[int, type[Message]]:
        return {}


def _union(old: tuple[T, ...], new: tuple[T, ...]) -> tuple[T, ...]:
    found = {item.abbrev: item for item in old}
    for item in new:
        if found.setdefault(item.abbrev, item) != item:
            raise SchemaError(f"{item.abbrev} is already defined differently: {found[item.abbrev].name}")
    return tuple(found.values())
