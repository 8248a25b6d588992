"""The contract between a network and what stands on it.

A link finds the systems of one network, brings their packets, and carries packets to them. It starts without raising:
`trouble` is a sentence for people while it cannot work, and it keeps trying. All calls in both directions are made in
the thread of the event loop.
"""

import getpass
import os
import socket
import time
from collections.abc import Collection, Iterable, Sequence
from typing import NamedTuple, Protocol, Self

import imc
from imc.discovery import CONSOLE, MESSAGES, Service, Services

EVERYBODY = "*"
EVERYTHING: frozenset[str] = frozenset()
NEAR = 1.5  # s for a system of this computer to appear
LONGEST_NAME = 48
FAR = 3.0  # s over a radio


class NetworkError(Exception):
    """An error for the user: no vehicle, no answer, a refusal."""


class VehicleLost(NetworkError):
    """The vehicle has ended or has fallen silent."""


class NoAnswer(NetworkError):
    """The vehicle is there, but does not answer."""


class Refused(NetworkError):
    """The vehicle rejects a request; the text is its reason."""


class Unlisted(Refused, NoAnswer):
    """The vehicle takes no orders and no questions of this console; the text is its reason."""


class ConsoleIdentity(NamedTuple):
    """This console: a system id of operators, its name in keys and announcements, and a text that names this run."""

    id: int
    name: str
    uid: str = ""

    @classmethod
    def of_this_program(cls, number: int) -> Self:
        """One whose name contains its user and computer: shoal-USER@HOST-ID."""
        try:
            user = getpass.getuser()
        except (KeyError, OSError):  # a container without a table of users
            user = str(os.getuid())
        who = "_".join(f"shoal-{user}@{socket.gethostname()}".split())[:LONGEST_NAME]
        return cls(number, f"{who}-{number:04X}", str(time.time_ns()))

    def announcement(self, services: Iterable[Service]) -> imc.Announce:
        """The Announce of this console."""
        own_services = Services.from_system_info(services, uid=self.uid, imc=imc.builtin().version)
        return imc.Announce(sys_name=self.name, sys_type=imc.SystemType.CCU, owner=0xFFFF, services=str(own_services))

    def naming_packet(self, network: str) -> bytes:
        """An Announce to systems of a network on which we take packets where they come from."""
        kind = self.announcement([Service(MESSAGES.scheme, MESSAGES.address, 0, CONSOLE + network)])
        return imc.encode_with_header(kind, time.time(), self.id, 0, 0, 0xFF)


class ReceivedPacket(NamedTuple):
    """A packet, and the data of the link on its source: names may be empty, `place` is for people.

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

    def on_vanished(self, link: "NetworkLink", system: str, part: str, *, is_reported: bool) -> None:
        """A part of a system is not there any more; `is_reported`: this was reported, it has not only fallen silent."""
        ...

    def on_dropped(self, link: "NetworkLink", peer: str, reason: str, number: int = 1) -> None:
        """Packets that did not arrive here, or could not be taken."""
        ...


class NetworkLink(Protocol):
    """One network."""

    name: str
    trouble: str
    delivers_all: bool
    """Whether the link brings all messages of a system, not only those that the system sends to consoles."""
    fragment_size: int
    """Bytes of a packet, beyond which it goes in pieces that get lost one by one; 0 if nothing gets lost."""

    @property
    def discovery_timeout(self) -> float:
        """The time (s) to wait for a system that has not appeared."""
        ...

    @property
    def awaits_answers(self) -> bool:
        """Whether a program has received our announcement and not answered: it is busy, or announces itself seldom."""
        ...

    async def open(self, listener: LinkListener, console: ConsoleIdentity) -> None:
        """Start; returns as soon as packets can come, or `trouble` gives the reason."""
        ...

    def subscribe(self, system: str, messages: Collection[str]) -> None:
        """Ask for messages of a system, from now on; EVERYBODY and EVERYTHING are possible. Links may bring more."""
        ...

    def unsubscribe(self, system: str, messages: Collection[str]) -> bool:
        """Ask no longer for what `subscribe` has asked for in the same words.

        Returns whether it ends with that; other links bring it nevertheless.
        """
        ...

    def send(self, system: str, message: imc.Message, packet: bytes) -> None:
        """Send a packet to a system, which has appeared here. One that cannot be sent is dropped."""
        ...

    async def close(self) -> None:
        """Leave. Nothing arrives afterward."""
        ...


def size_warning(ways: Sequence[NetworkLink], size: int) -> str:
    """Reason why a packet of so many bytes may not arrive by the first of these ways; empty if its length allows it."""
    piece = ways[0].fragment_size if ways else 0
    if not piece or size <= piece:
        return ""
    return f"its {size} bytes go in {-(-size // piece)} pieces, and one that is lost loses all: try imc+tcp://"
