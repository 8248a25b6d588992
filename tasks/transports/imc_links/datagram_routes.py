"""Destinations of a vehicle's datagrams, each with its list of messages."""

from collections.abc import Iterable, Iterator, Mapping

import imc
from imc.discovery import Endpoint, Services
from imc.reserved_ids import UNKNOWN_SYSTEM
from tasks.transports.imc_links.message_list import MessageList, parse_rate


def parse_endpoint(text: str) -> Endpoint:
    """An item of `Static Destinations`, such as 10.0.0.7:6001. Raises ValueError."""
    found = Services.parse(f"imc+udp://{text.strip()}/").endpoints("imc+udp")
    if not found:
        raise ValueError(f"{text.strip()!r} is not the IPv4 address of a computer and a port, such as 10.0.0.7:6001")
    return found[0]


def parse_peer_rate(item: str) -> tuple[str, str]:
    """The system and the rate of an item of `Peer Rates`, such as 0x4001/EstimatedState:20. Raises ValueError."""
    name, slash, rate = item.strip().partition("/")
    if not (name and slash):
        raise ValueError(f"{item.strip()!r} is not a system, a message and a rate, such as 0x4001/EstimatedState:20")
    parse_rate(rate)
    return name.strip(), rate


class DatagramRoutes:
    """Sends messages to systems: those of `lists` by a list of their own, all others by `common`.

    `static` are endpoints without a known system, which get messages in any case.
    """

    def __init__(self, common: MessageList, lists: Mapping[int, MessageList], static: Iterable[Endpoint]):
        self.common: MessageList = common
        self.lists: Mapping[int, MessageList] = lists
        self.static: list[Endpoint] = list(static)
        self._groups: list[tuple[MessageList, list[tuple[int, Endpoint]]]] = []

    def __bool__(self) -> bool:
        return bool(self._groups)

    @property
    def types(self) -> Iterable[type[imc.Message]]:
        """The types of messages that anybody gets."""
        return dict.fromkeys(kind for messages in (self.common, *self.lists.values()) for kind in messages.types)

    def messages(self, system: int) -> MessageList:
        """The messages that a system gets."""
        return self.lists.get(system, self.common)

    def update(self, contacts: Iterable[tuple[int, Endpoint]]) -> None:
        """Send to these systems from now on, at these endpoints, and to the static ones among which they are not."""
        groups: dict[int, list[tuple[int, Endpoint]]] = {}
        known: set[Endpoint] = set()
        for system, endpoint in contacts:
            known.add(endpoint)
            groups.setdefault(system if system in self.lists else UNKNOWN_SYSTEM, []).append((system, endpoint))
        for endpoint in self.static:
            if endpoint not in known:
                groups.setdefault(UNKNOWN_SYSTEM, []).append((UNKNOWN_SYSTEM, endpoint))
        self._groups = [(self.messages(system), places) for system, places in groups.items()]

    def destinations(self, message: imc.Message, now: float) -> Iterator[tuple[int, Endpoint]]:
        """The systems and endpoints that get a message at the time `now` (s)."""
        for messages, places in self._groups:
            if messages.passes(message, now):
                yield from places
