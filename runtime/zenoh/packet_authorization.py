"""Authorizes packets by key, source and destination: a name stands for one system, and commands have their own key.

zenoh's access control is by keys only. What it lets pass at the key of another vehicle must not command this one, or
speak for a third system.
"""

import struct
from collections.abc import Callable, Collection, Mapping
from urllib.parse import unquote

import imc
from imc.layout import LITTLE_ENDIAN
from imc.reserved_ids import ANNOUNCED, BROADCAST, OPERATORS, UNKNOWN_SYSTEM
from runtime.zenoh.key_expressions import ALL_SYSTEMS, HEARD, key_chunk
from runtime.zenoh.presence import ProcessPart
from runtime.zenoh.unlisted_consoles import UnlistedConsoles

TO_ALL = UNKNOWN_SYSTEM, ANNOUNCED, BROADCAST
OBEYED_FROM_ALL = {imc.Abort.ID: "an Abort", imc.MessagePart.ID: "a part of a message, which may be a command,"}
"""Messages that a vehicle takes from all though they have no addressee; those of another vehicle are its own."""
MOST_KEYS = 4096

LITTLE, BIG = (struct.Struct(order + "2xH10xHxH").unpack_from for order in "<>")  # id, source, destination


class PacketAuthorizer:
    """The rules of one process of a vehicle, `part`.

    `vehicles` are the names of other vehicles that access control lets in; `ids` gives the ids of those that run, by
    their names in keys. `system_name` gives the name of an id, `system_id` the id of a name that the profile lists;
    `is_sibling` returns whether a session (zenoh id) runs another part of this vehicle. `consoles` rejects orders of
    systems that are not listed.
    """

    def __init__(
        self,
        part: ProcessPart,
        vehicles: Collection[str],
        ids: Callable[[], Mapping[str, frozenset[int]]],
        system_name: Callable[[int], str],
        is_sibling: Callable[[str], bool],
        system_id: Callable[[str], int | None] = lambda _: None,
        consoles: UnlistedConsoles | None = None,
    ) -> None:
        self._consoles = consoles
        self._system = part.system
        self._name = key_chunk(part.vehicle)
        self._commanded = {self._name, f"0x{part.system:04X}", ALL_SYSTEMS}
        self._listed = {key_chunk(name) for name in vehicles} - {self._name}
        self._ids = ids
        self._system_name = system_name
        self._is_sibling = is_sibling
        self._system_id = system_id
        self._places: dict[str, tuple[str, str]] = {}

    def reject_reason(self, key: str, packet: bytes, session: str) -> str:
        """Reason why a packet (SMALLEST_PACKET or longer) of a session must not arrive from this key; "" if it may."""
        name, way = self._places.get(key) or self._place(key)
        kind, source, destination = (LITTLE if packet[0] == LITTLE_ENDIAN else BIG)(packet)
        if (source == self._system or way == HEARD) and not self._is_sibling(session):
            return "in the name of this vehicle"
        if way == HEARD or source == self._system:
            return ""
        if way == "@cmd":
            ours = name in self._commanded
            return "" if ours or destination not in (self._system, *TO_ALL) else "a command at another system's key"
        if destination == self._system:
            return f"a command belongs to imc/{self._name}/@cmd"
        return self._of_another(name, kind, source, destination)

    def is_of_unlisted_console(self, key: str, packet: bytes, session: str) -> bool:
        """Whether a packet that may come from this key is more than its system may send, which then gets the reason.

        What another vehicle publishes is no order: it is counted, and that vehicle gets no answer.
        """
        consoles = self._consoles
        if consoles is None or consoles.may_send(packet) or self._is_sibling(session):
            return False
        name, way = self._places.get(key) or self._place(key)
        if way == "@cmd":
            consoles.reject_and_answer(packet, unquote(key.rpartition("/")[2]))
        elif imc.packet_source(packet) in OPERATORS:
            consoles.reject_and_answer(packet, unquote(name))
        else:
            consoles.drop(packet, unquote(name))
        return True

    def _of_another(self, name: str, kind: int, source: int, destination: int) -> str:
        """Reason why another system may not publish this in its name."""
        ids, is_listed = self._ids().get(name, frozenset[int]()), name in self._listed
        if name == self._name or (ids and source not in ids):
            return f"of 0x{source:04X}, which is not {name}"
        known = None if ids else self._system_id(name)  # a running vehicle announces its id
        is_known = known is not None and known not in OPERATORS
        if is_known and source != known:
            return f"of 0x{source:04X}, which is not {name}"
        if is_listed:
            owner = self._system_name(source)  # by the profile: a token has only the vehicle's own claim
            if source in OPERATORS or (owner != name and key_chunk(owner) not in (name, f"0x{source:04X}")):
                return f"of {owner}, which is not {name}"
        is_vehicle = is_listed or is_known or (ids and source not in OPERATORS)
        if is_vehicle and kind in OBEYED_FROM_ALL and destination in TO_ALL:
            return f"{OBEYED_FROM_ALL[kind]} of another vehicle for all"
        return ""

    def _place(self, key: str) -> tuple[str, str]:
        """The system that a key names, and the chunk that begins with @ after it, if there is one."""
        if len(self._places) >= MOST_KEYS:
            self._places.clear()
        chunks = [*key.split("/", 3), "", ""]
        place = self._places[key] = chunks[1], chunks[2] if chunks[2].startswith("@") else ""
        return place
