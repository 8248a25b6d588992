"""The entities of a vehicle with their ids and states, and the names of the systems around it."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from fastcrc import crc16

from imc import EntityState

State = EntityState.State

SYSTEM_ENTITY = 0
LARGEST_ENTITY = 254


class EntityError(ValueError):
    """The label is empty or taken, or all ids are in use."""


@dataclass(slots=True, eq=False)
class Entity:
    """A part of the vehicle that can send messages.

    `component` is the section of its task. `stateful` becomes true with the first state that its task reports.
    `process` is the other process of the vehicle that runs this task, "" for this one; while it does not run, this
    process reports the state in its place (`orphan`).
    """

    id: int
    label: str
    component: str
    state: State = State.BOOT
    description: str = "initializing"
    stateful: bool = False
    activation_time: int = 0
    deactivation_time: int = 0
    process: str = ""
    orphan: bool = False


class EntityTable:
    """Labels and ids of one vehicle's entities, and the labels that other systems and processes report.

    An id follows from the label (its CRC-16, or the next free one), so it is the same in every run and every process of
    the vehicle, whatever other tasks run; if two labels lead to one id, the later one gets the next. `known` are
    labels that already have an id: those of the whole profile (see `assign_ids`), or of a log.
    """

    def __init__(self, system: int, known: Mapping[str, int] | None = None):
        self._system = system
        self._known = dict(known or {})
        self._by_id: dict[int, Entity] = {}
        self._by_label: dict[str, Entity] = {}
        self.remote_labels: dict[tuple[int, int], str] = {}

    def __iter__(self) -> Iterator[Entity]:
        return iter(sorted(self._by_id.values(), key=lambda entity: entity.id))

    def __len__(self) -> int:
        return len(self._by_id)

    def reserve(self, label: str, component: str) -> Entity:
        """A new entity. Raises EntityError if the label is empty or taken, or all 254 ids are."""
        if not label:
            raise EntityError(f"{component}: the entity label is empty")
        taken = self._by_label.get(label)
        if taken is not None:
            raise EntityError(f"{component}: the entity label {label!r} is taken by {taken.component}")
        entity = Entity(self._free_id(label), label, component)
        self._by_id[entity.id] = self._by_label[label] = entity
        return entity

    def add_other_process_entity(self, number: int, label: str, component: str, process: str) -> Entity | None:
        """An entity that another process of the vehicle runs; None if its id or label is taken."""
        if number in self._by_id or label in self._by_label or not label:
            return None
        entity = Entity(number, label, component, process=process)
        self._by_id[number] = self._by_label[label] = entity
        return entity

    def release(self, entity: Entity) -> None:
        self._by_id.pop(entity.id, None)
        self._by_label.pop(entity.label, None)

    @property
    def labels(self) -> list[str]:
        """The labels of all tasks of the profile, also of those that do not run now."""
        return sorted({*self._known, *self._by_label})

    def find(self, label: str) -> Entity | None:
        return self._by_label.get(label)

    def by_id(self, entity: int) -> Entity | None:
        return self._by_id.get(entity)

    def learn_label(self, system: int, entity: int, label: str) -> None:
        """Remember the label of an entity of another process or system."""
        if len(self.remote_labels) < 65536:
            self.remote_labels[system, entity] = label

    def label(self, system: int, entity: int) -> str:
        """The label of an entity of any system, empty if unknown."""
        if system == self._system and (own := self._by_id.get(entity)) is not None:
            return own.label
        return self.remote_labels.get((system, entity), "")

    def _free_id(self, label: str) -> int:
        if label == "Daemon":
            return SYSTEM_ENTITY
        if label in self._known and self._known[label] not in self._by_id:
            return self._known[label]
        return derive_entity_id(label, {*self._by_id, *self._known.values()})


def assign_ids(labels: Iterable[str], known: Mapping[str, int]) -> dict[str, int]:
    """An id for each label: the known one, else given out in order; labels beyond the 254 possible ids get none."""
    ids = dict(known)
    for label in dict.fromkeys(labels):
        if label not in ids and len(ids) < LARGEST_ENTITY and label != "Daemon":
            ids[label] = derive_entity_id(label, set(ids.values()))
    return ids


def derive_entity_id(label: str, taken: set[int]) -> int:
    """The id that follows from a label, or the next free one. Raises EntityError if all are taken."""
    first = crc16.arc(label.encode(errors="surrogateescape")) % LARGEST_ENTITY
    for step in range(LARGEST_ENTITY):
        candidate = 1 + (first + step) % LARGEST_ENTITY
        if candidate not in taken:
            return candidate
    raise EntityError(f"{label}: a vehicle has at most {LARGEST_ENTITY} entities")


class SystemTable:
    """Names and ids of IMC systems."""

    def __init__(self, ids: Mapping[str, int]):
        self._ids = dict(ids)
        self._names = {number: name for name, number in ids.items()}

    def name(self, system: int) -> str:
        """The name of a system, "0x1234" if it has none."""
        return self._names.get(system) or f"0x{system:04X}"

    def id(self, name: str) -> int | None:
        return self._ids.get(name)
