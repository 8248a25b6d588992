"""Names of the systems and labels of the entities in a log, from its messages."""

from collections.abc import Callable, Iterable
from difflib import get_close_matches
from typing import Any

import imc
from imc.discovery import displayable_name
from imc.reserved_ids import UNKNOWN_ENTITY, UNKNOWN_SYSTEM
from runtime.profile import own_etc, parse_imc_id, read_sections

NAMING = frozenset({imc.EntityInfo.ID, imc.EntityList.ID, imc.Announce.ID})
"""Ids of the messages that names come from."""

KEPT = NAMING | {imc.LoggingControl.ID}
"""Ids of the messages that describe a whole log, so that every part of it needs them."""
NEAR = 0.65  # of difflib: less gives suggestions that are far off


def label_text(label: str | None, number: int) -> str:
    """The label of an entity as it is shown; "entity 12" if it is unknown."""
    if label is None and number == UNKNOWN_ENTITY:
        return "unknown entity"
    return displayable_name(label or "") or f"entity {number}"


class UnknownNameError(ValueError):
    """A name that the log or its schema does not have; the text suggests similar ones."""


class SystemNames:
    """Names of systems and labels of entities, from Announce, EntityInfo and EntityList.

    A system that never announces itself has its name from Shoal's address table.
    labels: (system, entity) -> latest label. earlier: the labels that the entity had before in the same log.
    """

    def __init__(self) -> None:
        self.labels: dict[tuple[int, int], str] = {}
        self.earlier: dict[tuple[int, int], list[str]] = {}
        self._systems: dict[int, str] = {}
        self._table: dict[int, str] | None = None

    def learn(self, message: Any) -> None:
        """Store the names in a message; most messages have none."""
        kind = type(message).__name__
        if kind == "EntityInfo" and message.label:
            entity = message.id or message.src_ent  # DUNE's daemon also names others; new senders leave id at 0
            if entity != UNKNOWN_ENTITY:
                self._label(message.src, entity, message.label)
        elif kind == "EntityList" and message.op == imc.EntityList.Op.REPORT:
            for entry in message.list.split(";"):
                label, _, number = entry.rpartition("=")
                if label and number.isdecimal() and int(number) < UNKNOWN_ENTITY:
                    self._label(message.src, int(number), label)
        elif kind == "Announce" and (name := displayable_name(message.sys_name)):
            self._systems[message.src] = name

    def system_name(self, number: int) -> str:
        """The name of a system; "0x1234" if unknown."""
        if number in self._systems:
            return self._systems[number]
        if self._table is None:
            self._table = _address_table()
        return self._table.get(number) or f"0x{number:04X}"

    def entity_label(self, system: int, number: int) -> str:
        """The label of an entity; "entity 12" if the log has none."""
        return label_text(self.labels.get((system, number)), number)

    def find_system_ids(self, wanted: Iterable[str], present: Iterable[int]) -> set[int]:
        """Ids of systems given by name or number. Raises UnknownNameError."""
        known = {self.system_name(number): number for number in present}
        return {_choose(text, known, "system", _number) for text in wanted}

    def find_entity_ids(self, wanted: Iterable[str], present: Iterable[tuple[int, int]]) -> set[tuple[int, int]]:
        """(system, entity) of all entities given by label or number. Raises UnknownNameError."""
        known: dict[str, set[tuple[int, int]]] = {}
        for system, number in present:
            for name in {self.entity_label(system, number), str(number)}:
                known.setdefault(name, set()).add((system, number))
        found: set[tuple[int, int]] = set()
        for text in wanted:
            found |= _choose(text, known, "entity")
        return found

    def _label(self, system: int, number: int, label: str) -> None:
        before = self.labels.get((system, number))
        if before is not None and before != label:
            earlier = self.earlier.setdefault((system, number), [])
            if before not in earlier:
                earlier.append(before)
        self.labels[system, number] = label


def find_message_ids(wanted: Iterable[str], schema: imc.Schema) -> set[int]:
    """Ids of messages given by name or id. Raises UnknownNameError."""
    known = {name: message.id for name, message in schema.types.items()}
    return {_choose(text, known, "message", _number) for text in wanted}


def type_name(schema: imc.Schema, number: int) -> str:
    """The name of a message; "id 1234" if the schema does not have it."""
    found = schema.types_by_id.get(number)
    return found.abbrev if found else f"id {number}"


def _choose(text: str, known: dict[str, Any], what: str, otherwise: Callable[[str], int | None] | None = None) -> Any:
    folded = {name.lower(): value for name, value in known.items()}
    if (value := known.get(text, folded.get(text.lower()))) is not None:
        return value
    if otherwise and (value := otherwise(text)) is not None:
        return value
    near = get_close_matches(text.lower(), folded, 3, NEAR)
    names = ", ".join(dict.fromkeys(name for low in near for name in known if name.lower() == low))
    raise UnknownNameError(f"there is no {what} {text!r}" + (f"; did you mean {names}?" if names else ""))


def _number(text: str) -> int | None:
    try:
        number = int(text, 0)
    except ValueError:
        return None
    return number if 0 <= number <= UNKNOWN_SYSTEM else None


def _address_table() -> dict[int, str]:
    addresses = read_sections(own_etc() / "common" / "imc-addresses.ini").get("IMC Addresses", {})
    found: dict[int, str] = {}
    for name, text in addresses.items():
        found.setdefault(parse_imc_id(text), name)
    return found
