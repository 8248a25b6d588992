"""The contract between a network and what stands on it.

A link finds the systems of one network, brings their packets, and carries packets to them. It starts without raising:
`trouble` is a sentence for people while it cannot work, and it keeps trying. All calls in both directions are made in
the thread of the event loop.
"""

from collections.abc import Collection, Sequence
from typing import NamedTuple, Protocol

import imc

EVERYBODY = "*"
EVERYTHING: frozenset[str] = frozenset()
NEAR = 1.5  # s for a system of this computer to appear
FAR = 3.0  # s over a radio


class NetworkError(Exception):
    """A sentence for people: nobody there, no answer, a refusal."""


class VehicleLost(NetworkError):
    """The vehicle has ended or has fallen silent."""


class NoAnswer(NetworkError):
    """The vehicle is there, but does not answer."""


class Refused(NetworkError):
    """The vehicle says no; the text is its reason."""


class Unlisted(Refused, NoAnswer):
    """The vehicle takes no orders and no questions of this console; the text is its reason."""


class ConsoleIdentity(NamedTuple):
    """Who we are: a system id of operators, and the name in keys and announcements."""

    id: int
    name: str


class ReceivedPacket(NamedTuple):
    """A packet, and what the link knows about its source: names may be empty, `place` is for people.

    `is_old`: not new, but the last one of its kind, which was kept for us.
    """

    packet: bytes
    system: str = ""
    entity: str = ""
    place: str = ""
    is_old: bool = False


class LinkListener(Protocol):
    """Events of a link."""

    def on_packet(self, link: "NetworkLink", arrival: ReceivedPacket) -> None:
        """A packet, as it came; it may be damaged."""
        ...

    def on_appeared(self, link: "NetworkLink", system: str, part: str, place: str, number: int | None = None) -> None:
        """A system, or another process of it (`part`), is there, at a place; `number` is its id, if that is known."""
        ...

    def on_vanished(self, link: "NetworkLink", system: str, part: str, *, is_told: bool) -> None:
        """A part of a system is not there any more; `is_told`: something said so, it has not only fallen silent."""
        ...

    def on_dropped(self, link: "NetworkLink", peer: str, reason: str, number: int = 1) -> None:
        """Packets that did not arrive here, or could not be taken."""
        ...


class NetworkLink(Protocol):
    """One network."""

    name: str
    trouble: str
    delivers_all: bool
    """Whether it brings all messages of a system, not only those that the system sends to consoles."""
    fragment_size: int
    """Bytes of a packet, beyond which it goes in pieces that get lost one by one; 0 if nothing gets lost."""

    @property
    def discovery_timeout(self) -> float:
        """How long it makes sense to wait for a system that has not appeared (s)."""
        ...

    async def open(self, ear: LinkListener, console: ConsoleIdentity) -> None:
        """Start; returns as soon as packets can come, or `trouble` says why not."""
        ...

    def subscribe(self, system: str, messages: Collection[str]) -> None:
        """Ask for messages of a system, from now on; EVERYBODY and EVERYTHING are possible. Links may bring more."""
        ...

    def send(self, system: str, message: imc.Message, packet: bytes) -> None:
        """Send a packet to a system, which has appeared here. One that cannot be sent is dropped."""
        ...

    async def close(self) -> None:
        """Leave. Nothing arrives afterwards."""
        ...


def size_warning(ways: Sequence[NetworkLink], size: int) -> str:
    """Why a packet of so many bytes may not arrive by the first of these ways; empty if it is not for its length."""
    piece = ways[0].fragment_size if ways else 0
    if not piece or size <= piece:
        return ""
    return f"its {size} bytes go in {-(-size // piece)} pieces, and one that is lost loses all: try imc+tcp://"
