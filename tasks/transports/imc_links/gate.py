"""Decides which datagrams reach the bus: from whom, from where, how many, and what they ask for."""

from collections.abc import Collection

import imc
from imc.addresses import UNKNOWN_SYSTEM
from imc.discovery import Endpoint, Service, Services
from tasks.transports.imc_links.consoles import Consoles
from tasks.transports.imc_links.peers import ELSEWHERE, MALFORMED, UNKNOWN, Peer, Peers

SPOOFED = "sent as this vehicle"
NOT_LISTED = "command of a console that is not listed"
LITTLE_ENDIAN = 0x54  # first byte of a packet
ANNOUNCE = imc.Announce.ID
SHORTEST = 22  # bytes of a packet
STRANGERS = 20.0  # Announces per second of all systems that are unknown yet


class Gate:
    """Judges datagrams by their first bytes, before they are decoded.

    `system` is the id of this vehicle: what claims to be from it is spoofed. Systems at an endpoint of `static` need
    no Announce, nor does any with `ignore_filter`. Each may send `rate` per second.
    """

    def __init__(
        self,
        system: int,
        peers: Peers,
        consoles: Consoles,
        *,
        static: Collection[Endpoint] = (),
        ignore_filter: bool = False,
        rate: float = 2000.0,
    ):
        self._system = system
        self._peers = peers
        self._by_id = peers.by_id
        self._consoles = consoles
        self._open = not consoles.listed
        self._static = static
        self._ignore_filter = ignore_filter
        self._rate = rate
        self._strangers = Peer(UNKNOWN_SYSTEM, "")

    def judge(self, packet: bytes, address: str, port: int, now: float) -> Peer | str:
        """The peer that a datagram is from; else the reason to drop it."""
        if len(packet) < SHORTEST:
            return MALFORMED
        little = packet[0] == LITTLE_ENDIAN
        source = packet[14] | packet[15] << 8 if little else packet[14] << 8 | packet[15]
        peer = self._by_id.get(source)
        if peer is not None and peer.sees == address and peer.filled == now and peer.left >= 1.0 and self._open:
            peer.left -= 1.0  # most packets of a burst need no more than this
            return peer
        if source == self._system:
            return SPOOFED
        peer = self._peers.sender(source, address, now, self._rate)
        if peer is UNKNOWN:
            peer = self._meet(source, address, port, now)
        if not self._open and isinstance(peer, Peer):
            kind = int.from_bytes(packet[2:4], "little" if little else "big")
            return peer if self._consoles.allow(source, address, kind) else NOT_LISTED
        return peer

    def greets(self, packet: bytes, reason: str, now: float) -> bool:
        """Whether a datagram that was not taken may be the Announce that makes its sender known, or known there."""
        if reason not in (UNKNOWN, ELSEWHERE):
            return False
        order = "little" if packet[0] == LITTLE_ENDIAN else "big"
        return int.from_bytes(packet[2:4], order) == ANNOUNCE and self._strangers.admits(now, STRANGERS)

    def _meet(self, source: int, address: str, port: int, now: float) -> Peer | str:
        if (address, port) in self._static:
            services = Services.of([Service("imc+udp", address, port)])
        elif self._ignore_filter:
            services = Services()
        else:
            return UNKNOWN
        peer = self._peers.announce(source, f"0x{source:04X}", services, now)
        return UNKNOWN if peer is None else peer


def source_of(packet: bytes) -> int:
    """The system in the header of a packet of at least SHORTEST bytes."""
    return int.from_bytes(packet[14:16], "little" if packet[0] == LITTLE_ENDIAN else "big")


def sender(packet: bytes, address: str) -> str:
    """Who sent a datagram, for people."""
    return address if len(packet) < SHORTEST else f"0x{source_of(packet):04X} at {address}"
