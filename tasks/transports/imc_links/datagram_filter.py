"""Decides which datagrams reach the bus: from whom, from where, how many, and what they ask for."""

from collections.abc import Collection

import imc
from imc.console_acl import NOT_LISTED, ConsoleAcl
from imc.discovery import Endpoint, Service, Services
from imc.layout import LITTLE_ENDIAN, SMALLEST_PACKET
from support.token_bucket import TokenBucket
from tasks.transports.imc_links.peer_table import ELSEWHERE, MALFORMED, UNKNOWN, Peer, PeerTable

SPOOFED = "sent as this vehicle"
STARTS = tuple(imc.Message.SYNC.to_bytes(2, order) for order in ("little", "big"))
ANNOUNCE, ABORT = imc.Announce.ID, imc.Abort.ID
STRANGERS = 20.0  # at once: Announces, and per second Aborts, of all systems that are unknown yet
NEW_RATE = 2.0  # Announces of them per second in the long run: each becomes a peer, which is sent everything


class DatagramFilter:
    """Judges datagrams by their first bytes, before they are decoded.

    `system` is the id of this vehicle: what claims to be from it is spoofed. Systems at an endpoint of `static` need
    no Announce, nor does any with `ignore_filter`, nor an Abort for this vehicle.
    """

    def __init__(
        self,
        system: int,
        peers: PeerTable,
        consoles: ConsoleAcl,
        *,
        static: Collection[Endpoint] = (),
        ignore_filter: bool = False,
    ):
        self._system = system
        self._peers = peers
        self._by_id = peers.by_id
        self._consoles = consoles
        self._open = consoles.is_open
        self._static = static
        self._ignore_filter = ignore_filter
        self._strangers = TokenBucket(NEW_RATE, STRANGERS)
        self._moved, self._aborts = TokenBucket(STRANGERS, STRANGERS), TokenBucket(STRANGERS, STRANGERS)

    def evaluate(self, packet: bytes, address: str, port: int, now: float) -> Peer | str:
        """The peer that a datagram is from; else the reason to drop it."""
        if len(packet) < SMALLEST_PACKET:
            return MALFORMED
        # As imc.packet_source says; a call of it takes a fifth of the time that most packets need here.
        source = packet[14] | packet[15] << 8 if packet[0] == LITTLE_ENDIAN else packet[14] << 8 | packet[15]
        peer = self._by_id.get(source)
        if peer is not None and peer.source == address and self._open:
            bucket = peer.bucket
            if bucket.now == now and bucket.left >= 1.0:  # most packets of a burst need no more than this
                bucket.left -= 1.0
                return peer
        if packet[:2] not in STARTS:
            return MALFORMED
        if source == self._system:
            return SPOOFED
        peer = self._peers.identify_sender(source, address, now)
        if peer is UNKNOWN:
            peer = self._add_peer(source, address, port, now)
            if peer is UNKNOWN and self._is_strangers_abort(packet, now):
                peer = Peer(source, f"0x{source:04X}", self._aborts, source=address)
        if not self._open and isinstance(peer, Peer):
            return peer if self._consoles.allows(source, address, imc.packet_id(packet)) else NOT_LISTED
        return peer

    def is_unknown_sender_announce(self, packet: bytes, reason: str, now: float) -> bool:
        """Whether a datagram that was not taken may be the Announce that makes its sender known, or known there."""
        if reason not in (UNKNOWN, ELSEWHERE) or imc.packet_id(packet) != ANNOUNCE:
            return False
        return self._moved.try_acquire(now) if reason is ELSEWHERE else self._strangers.try_acquire(now)

    def _is_strangers_abort(self, packet: bytes, now: float) -> bool:
        """Whether a stranger's datagram is an Abort for this vehicle: who needs it may find no room to announce."""
        wanted = imc.packet_id(packet) == ABORT and imc.header(packet).dst == self._system
        return wanted and self._aborts.try_acquire(now)

    def _add_peer(self, source: int, address: str, port: int, now: float) -> Peer | str:
        if (address, port) in self._static:
            services = Services.from_system_info([Service("imc+udp", address, port)])
        elif self._ignore_filter:
            services = Services()
        else:
            return UNKNOWN
        peer = self._peers.on_announce(source, f"0x{source:04X}", services, now)
        return UNKNOWN if peer is None else peer


def sender_text(packet: bytes, address: str) -> str:
    """The sender of a datagram, for people; a datagram that is no packet has only an address."""
    is_packet = len(packet) >= SMALLEST_PACKET and packet[:2] in STARTS
    return f"0x{imc.packet_source(packet):04X} at {address}" if is_packet else address
