"""Table of the systems on the networks: names, ids, positions, latest messages, and errors."""

import asyncio
import math
import time
from collections import Counter, deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeVar

import imc
from imc.discovery import PERIOD, Services
from imc.reserved_ids import OPERATORS
from shoal.network.link import NetworkLink, ReceivedPacket

M = TypeVar("M", bound=imc.Message)
MOST_SYSTEMS = 256
MOST_KEPT = 2048  # messages of one system
MOST_LABELS = 255
MOST_RUNS = 16  # processes of a system that are remembered on each link
SILENCE = 5.0  # s; a system sends Heartbeat at 1 Hz
FORGOTTEN = 1.2 * PERIOD  # s of silence after which a second vehicle of one name counts no longer
STEP = 60.0  # s; a time stamp that is older than this before the last one means that the clock was set
WRONG = (imc.EntityState.State.FAULT, imc.EntityState.State.ERROR, imc.EntityState.State.FAILURE)
STILL_SENDING = (
    2.5  # s since its last packet, after which a system that vanishes has fallen silent before; Heartbeat has 1 Hz
)
PATIENCE = 3.0  # s for an answer
CONTACT = 20.0  # s from the Announce of a DUNE to its first data: it may miss our first one, and sends every 5 s
FRESH = 3.0  # s; a packet that also comes over another network counts only if the first was silent for so long


@dataclass(eq=False)
class NetworkSystem:
    """A system, by its name. Times are of `time.monotonic`, in s; NaN or 0 before the first.

    parts: where its processes are, by link and process. received: packets by link. missed: packets that were lost, or
    could not be read, by reason. others: further ids that use its name. rivals: further systems that use its id. clock:
    its time stamps less our time (s), the smallest difference of the last packets. has_ended: whether its end was
    announced. seen: when each of its ids was received last. appeared_at: when its newest process appeared. data_at:
    when it sent another message than Announce last.
    """

    name: str
    id: int | None = None
    parts: dict[tuple[str, str], str] = field(default_factory=dict[tuple[str, str], str])
    links: dict[str, NetworkLink] = field(default_factory=dict[str, NetworkLink])
    received: Counter[str] = field(default_factory=Counter[str])
    last: dict[str, float] = field(default_factory=dict[str, float])
    missed: Counter[str] = field(default_factory=Counter[str])
    others: dict[int, str] = field(default_factory=dict[int, str])
    seen: dict[int, float] = field(default_factory=dict[int, float])
    rivals: "list[NetworkSystem]" = field(default_factory=list["NetworkSystem"])
    labels: dict[int, str] = field(default_factory=dict[int, str])
    clock: float = float("nan")
    received_at: float = field(default_factory=time.monotonic)
    appeared_at: float = field(default_factory=time.monotonic)
    data_at: float = 0.0
    has_ended: bool = False
    latest: dict[tuple[str, int], imc.Message] = field(default_factory=dict[tuple[str, int], imc.Message])
    _runs: dict[str, deque[str]] = field(default_factory=dict[str, deque[str]], init=False, repr=False)
    _restarted_at: float = field(default=-math.inf, init=False, repr=False)

    @property
    def age(self) -> float:
        """Time since its last packet, or before the first since it appeared (s)."""
        return time.monotonic() - self.received_at

    @property
    def is_there(self) -> bool:
        """Whether one of its processes is known to run, or it was received a short time ago."""
        return bool(self.parts) or (bool(self.last) and self.age < SILENCE)

    @property
    def has_only_announced(self) -> bool:
        """Whether the system has announced itself since it appeared, but sent nothing yet."""
        return self.data_at < self.appeared_at

    @property
    def is_shoal(self) -> bool:
        """Whether the system runs Shoal, by its Announce or zenoh: then copies of an order are carried out once."""
        if any(name.startswith("zenoh") for name in self.links):
            return True
        announce = self.latest_message(imc.Announce)
        return announce is not None and Services.parse(announce.services).version == "shoal"

    @property
    def awaits_contact(self) -> bool:
        """Whether the system may not receive us: a DUNE that has sent no data over UDP."""
        return self.has_only_announced and self.links.keys() <= {"udp"} and not self.is_shoal

    @property
    def contact_timeout(self) -> float:
        """The time (s) that the first data of a DUNE may still need; 0 if they have come, or are overdue."""
        return max(0.0, self.appeared_at + CONTACT - time.monotonic()) if self.awaits_contact else 0.0

    @property
    def answer_timeout(self) -> float:
        """The time (s) to wait for its answer."""
        return PATIENCE + self.contact_timeout

    @property
    def is_vehicle(self) -> bool:
        """Whether the system is no console: its id, once known, is not one of an operator."""
        return self.id is None or self.id not in OPERATORS

    @property
    def ids(self) -> list[int]:
        """Id of the system; if several vehicles have its name, those of all."""
        return sorted({*([] if self.id is None else [self.id]), *self.others})

    @property
    def has_duplicate_identity(self) -> bool:
        """Whether two vehicles have both its name and its id. One may have several processes on zenoh."""
        return sum(link == "udp" for link, _ in self.parts) > max(1, len(self.ids))  # integers

    @property
    def conflict_text(self) -> str:
        """The error that several vehicles use this name or id; empty if it is one."""
        if self.others:
            ids = ", ".join(f"0x{number:04X}" for number in self.ids)
            words = f"several vehicles have this name, with the ids {ids}"
        elif self.has_duplicate_identity:
            words = "several vehicles have this name and id"
        elif rivals := self.systems_with_same_id:
            where = "; ".join(" ".join((rival.name, *rival.addresses)) for rival in rivals)
            words = f"its id 0x{self.id or 0:04X} is also that of {where}"
        else:
            return ""
        return f"{words} ({'; '.join(self.addresses)})" if self.addresses else words

    @property
    def systems_with_same_id(self) -> "list[NetworkSystem]":
        return [rival for rival in self.rivals if rival.is_there]

    @property
    def addresses(self) -> list[str]:
        return sorted({place for place in self.parts.values() if place})

    def accepts_link(self, link: NetworkLink) -> bool:
        """Whether packets that come by this link count: one link is used until it is silent.

        It is one that brings all messages, if there is one, else the first.
        """
        now = time.monotonic()
        fresh = [self.links[name] for name, at in self.last.items() if now - at < FRESH and name in self.links]
        return max([*fresh, link], key=lambda each: each.delivers_all).name == link.name

    def count_packet(self, link: NetworkLink, message: imc.Message) -> None:
        """Count a packet, and what cannot be read of it. Announce goes to everybody: it is no sign of a contact."""
        self.received[link.name] += not isinstance(message, imc.Announce)
        if isinstance(message, imc.Unknown):
            self.missed[f"unknown message id {message.id}"] += 1
        elif message.surplus:
            self.missed[f"schema mismatch: {type(message).__name__} is longer than ours"] += 1

    def update(self, link: NetworkLink, message: imc.Message, entity: str, *, is_received: bool) -> None:
        """Store the data of a packet on the system besides its content; `entity` is its label, if known to the link.

        `is_received` is whether the packets of this link count, by `accepts_link`.
        """
        if is_received:
            self.last[link.name] = self.received_at = time.monotonic()
        if not isinstance(message, imc.Announce):
            self.data_at = time.monotonic()
        self.links.setdefault(link.name, link)
        self.update_clock_offset(message.timestamp)
        if entity and message.src_ent <= MOST_LABELS:
            self.labels.setdefault(message.src_ent, entity)
        if isinstance(message, imc.EntityList) and message.op == imc.EntityList.Op.REPORT:
            self.learn_labels(message)
        elif isinstance(message, imc.EntityInfo) and message.label:
            self.labels[message.src_ent] = message.label

    def store_latest(self, message: imc.Message) -> None:
        place = type(message).__name__, message.src_ent
        known = self.latest.get(place)
        if known is not None and known.timestamp > message.timestamp > known.timestamp - STEP:
            return
        if place in self.latest or len(self.latest) < MOST_KEPT:
            self.latest[place] = message

    def forget_latest(self, name: str) -> None:
        """Forget the newest messages of a type."""
        for place in [place for place in self.latest if place[0] == name]:
            del self.latest[place]

    def note_process(self, link: str, part: str) -> None:
        """Note that a process has appeared; one that replaces another is a restart, which ends what was known.

        A restart is noticed on each link, later on those where the system announces itself every ten seconds.
        """
        known = self._runs.setdefault(link, deque(maxlen=MOST_RUNS))
        if part in known:
            return
        is_alone = not any(link_name == link for link_name, _ in self.parts)
        if known and is_alone and time.monotonic() - self._restarted_at > FORGOTTEN:
            self._restarted_at = time.monotonic()
            self.labels.clear()
            for place in [place for place in self.latest if place[0] != imc.Announce.__name__]:
                del self.latest[place]
        known.append(part)

    def latest_message(self, kind: type[M], entity: str = "") -> M | None:
        """The newest message of a type, of one entity (label) if it is named."""
        found: M | None = None
        for (name, source), message in self.latest.items():
            if name == kind.__name__ and isinstance(message, kind) and self.matches_label(source, entity):
                found = message if found is None or message.timestamp >= found.timestamp else found
        return found

    def latest_entity_messages(self, kind: type[M]) -> Iterator[M]:
        """The last message of a type from each entity."""
        return (message for message in list(self.latest.values()) if isinstance(message, kind))

    @property
    def errors(self) -> dict[str, str]:
        """The entities that report an error, a fault or a failure, by label, and their texts.

        VehicleState names only those that it is configured to watch.
        """
        states = sorted(self.latest_entity_messages(imc.EntityState), key=lambda state: state.src_ent)
        found = {self.label(state.src_ent): state.description for state in states if state.state in WRONG}
        vehicle = self.latest_message(imc.VehicleState)
        for label in vehicle.error_ents.split(",") if vehicle is not None else ():
            if label:
                found.setdefault(label, "")
        return found

    def label(self, entity: int) -> str:
        """The label of an entity, its number if it is unknown."""
        return self.labels.get(entity, str(entity))

    def matches_label(self, entity: int, label: str) -> bool:
        """Whether an entity has a label; keys of zenoh have _ for blanks. Any has the empty one."""
        return not label or "_".join(self.label(entity).split()) == "_".join(label.split())

    def learn_labels(self, entities: imc.EntityList) -> None:
        for entry in entities.list.split(";"):
            label, _, number = entry.rpartition("=")
            if label and number.isascii() and number.isdecimal() and int(number) <= MOST_LABELS:
                self.labels[int(number)] = label

    def update_clock_offset(self, timestamp: float) -> None:
        difference = timestamp - time.time()
        if self.clock != self.clock or abs(difference) < abs(self.clock):
            self.clock = difference
        else:
            self.clock += 0.01 * (difference - self.clock)


class NetworkSystemTable(dict[str, NetworkSystem]):
    """The systems on all networks, by name; `changed` is set when one appears, vanishes, or gets known."""

    def __init__(self) -> None:
        super().__init__()
        self.changed: asyncio.Event = asyncio.Event()

    def find_or_add(self, name: str) -> NetworkSystem | None:
        """The system of a name; None if there is no room for one more."""
        found = self.get(name)
        if found is None and name and len(self) < MOST_SYSTEMS:
            found = self[name] = NetworkSystem(name)
        return found

    def add_process(self, link: NetworkLink, name: str, part: str, place: str, number: int | None) -> None:
        """Note that a process, `part`, of a system has appeared at a place on a link, and its id if that is known."""
        found = self.find_or_add(name)
        if found is None:
            return
        if number is not None:
            self.assign_id(found, number, place)
        if (link.name, part) not in found.parts:
            found.appeared_at = time.monotonic()
            found.note_process(link.name, part)
        found.links[link.name] = link
        found.has_ended = False
        found.parts[link.name, part] = place or found.parts.get((link.name, part), "")
        self.changed.set()

    def remove_process(self, link: NetworkLink, name: str, part: str, *, is_reported: bool) -> None:
        """Note that a process of a system has vanished from a link; `is_reported` if it has reported so itself."""
        found = self.get(name)
        if found is None:
            return
        found.has_ended = (
            is_reported and found.age < STILL_SENDING
        )  # zenoh also reports the end of one that was never received
        found.parts.pop((link.name, part), None)
        if not any(link_name == link.name for link_name, _ in found.parts):
            found.links.pop(link.name, None)
            found.last.pop(link.name, None)
        self.changed.set()

    def sender_of(self, arrival: ReceivedPacket, number: int) -> NetworkSystem | None:
        """The sender of a packet: by the name that came with it, else by its id."""
        if not arrival.system:
            return next((system for system in self.values() if system.id == number), None)
        system = self.find_or_add(arrival.system)
        if system is not None:
            self.assign_id(system, number, arrival.place)
        return system

    def assign_id(self, system: NetworkSystem, number: int, place: str) -> None:
        """Note the id of a system; another one than before is that of a second vehicle, if the first still sends."""
        now = time.monotonic()
        for silent in [each for each, at in system.seen.items() if now - at > FORGOTTEN and each != number]:
            del system.seen[silent]
            system.others.pop(silent, None)
            if silent == system.id:
                system.id = None
        if len(system.seen) < MOST_SYSTEMS or number in system.seen:
            system.seen[number] = now
        if system.id is None:
            system.others.pop(number, None)
            system.id = number
            known = [system, *system.rivals]
            for rival in [other for other in self.values() if other.id == number and other not in known]:
                if f"0x{number:04X}" not in (system.name, rival.name):  # a number stands for a name not yet received
                    rival.rivals.append(system)
                    system.rivals.append(rival)
            self.changed.set()
        elif system.id != number and len(system.others) < MOST_SYSTEMS:
            system.others[number] = place
