"""Systems that announce themselves over IMC, and their packets over UDP; we announce ourselves as a console does."""

import asyncio
import errno
import socket
import time
from collections.abc import Callable, Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass

import imc
from imc.discovery import (
    BROADCAST,
    LOOPBACK,
    MULTICAST,
    PERIOD,
    PORTS,
    Endpoint,
    Service,
    Services,
    announce_targets,
    displayable_name,
)
from imc.reserved_ids import OPERATORS
from runtime.network_interfaces import EVERYWHERE, interfaces, is_loopback_host, refused_destinations
from shoal.network.link import EVERYBODY, FAR, NEAR, ConsoleIdentity, LinkListener, ReceivedPacket
from shoal.network.udp_sockets import bound_socket, discovery_socket, own_address, waiting_datagrams

USUAL_PORTS = range(6002, 6007)  # where vehicles listen; asked if no announcement can be received
BEAT = 1.0  # s
AGAIN = (0.5, 0.6, 1.5, 2.5)  # s between the first Announces, of which a radio may lose some; then PERIOD
SILENCE = 4.0  # s; a system that we send Heartbeat sends its own at 1 Hz
UNSEEN = 2.5 * PERIOD  # s without Announce
MISSED = 600.0  # s for which a system that fell silent is called
MOST_PEERS = 256
PORTS_OF_CONSOLES = 20000
"""A console takes packets at this port and the number of its id among those of consoles."""


@dataclass
class _Peer:
    """A system that has announced itself; times in s of `time.monotonic`."""

    id: int
    name: str
    uid: str
    endpoint: Endpoint
    announced: float
    received: float = 0.0

    @property
    def seen(self) -> float:
        return max(self.announced, self.received)


class UDPLink:
    """The systems that announce themselves to this computer, or to its networks.

    `places` are addresses to announce to, and perhaps ports to talk to: by default the loopback address; 0.0.0.0 stands
    for all networks. `ports` are those of discovery.
    """

    name = "udp"
    delivers_all = False
    fragment_size = 1472  # of Ethernet, without the headers of IP and UDP

    def __init__(self, places: Collection[Endpoint] = (Endpoint(LOOPBACK, 0),), ports: Sequence[int] = PORTS) -> None:
        self.trouble: str = "not open yet"
        self._places = tuple(places)
        self._ports = ports
        self._peers: dict[int, _Peer] = {}
        self._twins: dict[str, _Peer] = {}  # further systems with the id of a peer, by their run
        self._missed: dict[int, _Peer] = {}  # fell silent: its network may come back
        self._sockets: list[socket.socket] = []
        self._beating: asyncio.Task[None] | None = None
        self._refused: set[Endpoint] = set()
        self._own_place: Endpoint | None = None
        self._has_received = False
        self._rival_received = 0.0
        self.deaf: bool = False
        self.is_far: bool = not all(is_loopback_host(place.address) for place in self._places)

    @property
    def discovery_timeout(self) -> float:
        if self.awaits_answers or (self.is_far and self._has_received):
            return PERIOD + 1.0
        return FAR if self.is_far else NEAR

    @property
    def awaits_answers(self) -> bool:
        here = {Endpoint(LOOPBACK, port) for port in self._ports} - {self._own_place}
        asked = here | {place for place in self._places if place.port}
        return len(asked - self._refused) > len(self._everybody())

    async def open(self, listener: LinkListener, console: ConsoleIdentity) -> None:
        self._listener, self._console = listener, console
        address = EVERYWHERE if self.is_far else LOOPBACK
        try:
            self._data = _bound_socket(address, console)
        except OSError as error:
            self.trouble = f"no UDP socket: {error.strerror}"
            return
        self._watch(self._data, self._read_data)
        self._discovery = discovery_socket(address, self._ports)
        if self._discovery is None:
            self.deaf = True
        else:
            self._own_place = Endpoint(LOOPBACK, self._discovery.getsockname()[1])
            self._watch(self._discovery, self._read_announcements)
        self.trouble = ""
        self._beating = asyncio.create_task(self._beat())

    def subscribe(self, system: str, messages: Collection[str]) -> None:
        """The vehicle's profile decides what it sends."""

    def unsubscribe(self, system: str, messages: Collection[str]) -> bool:
        """The systems send the same to all consoles."""
        return False

    def send(self, system: str, message: imc.Message, packet: bytes) -> None:
        # An abort is for all vehicles of a name: to miss one of two would be the dangerous mistake.
        for peer in self._everybody() if isinstance(message, imc.Abort) else self._peers.values():
            if system in (peer.name, EVERYBODY):
                self._send(packet, peer.endpoint)

    async def close(self) -> None:
        if self._beating is not None:
            self._beating.cancel()
            with suppress(asyncio.CancelledError):
                await self._beating
        for one in self._sockets:
            asyncio.get_running_loop().remove_reader(one)
            one.close()
        self._sockets.clear()

    def _watch(self, one: socket.socket, read: Callable[[], object]) -> None:
        self._sockets.append(one)
        asyncio.get_running_loop().add_reader(one, read)

    async def _beat(self) -> None:
        """Announce, send Heartbeat to all that announce themselves, and notice who is silent."""
        wait = iter(AGAIN)
        next_announce = 0.0
        while True:
            now = time.monotonic()
            if self._rival_received and now - self._rival_received > UNSEEN:
                self._rival_received, self.trouble = 0.0, ""
            if now >= next_announce:
                self._announce()
                next_announce = now + next(wait, PERIOD)
            for peer in self._everybody():
                if peer.received and now - peer.received > SILENCE:
                    self._lose(peer, is_reported=False)
                    self._missed[peer.id] = peer
                elif now - peer.announced > UNSEEN:
                    self._lose(peer, is_reported=False)
                elif peer.received:
                    self._send(self._packet(imc.Heartbeat(), peer.id), peer.endpoint)
                else:
                    self._greet(peer)
            self._missed = {id: peer for id, peer in self._missed.items() if now - peer.received < MISSED}
            for peer in self._missed.values():
                self._greet(peer)
            await asyncio.sleep(min(BEAT, next_announce - now))

    def _announce(self) -> None:
        self._refused.clear()
        addresses = [place.address for place in self._places]
        if EVERYWHERE in addresses:
            addresses = [LOOPBACK, BROADCAST, *(a for a in addresses if a != EVERYWHERE)]
            self._announce_on_interfaces()
        given = [place for place in self._places if place.port]
        if self.deaf:
            given += [Endpoint(LOOPBACK, port) for port in USUAL_PORTS]
        for place in announce_targets(addresses, self._ports):
            self._send(self._announcement(place), place)
        for place in given:
            self._send(self._announcement(place), place)
            self._send(self._packet(imc.Heartbeat(), 0xFFFF), place)

    def _announce_on_interfaces(self) -> None:
        """Announce on each network of this computer: a radio's is seldom the one with the default route."""
        for interface in interfaces():
            try:
                self._data.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(interface.address))
            except OSError:  # its address is gone since it was asked for
                continue
            for place in announce_targets(filter(None, (MULTICAST, interface.broadcast)), self._ports):
                self._send(self._announcement(place, interface.address), place)

    def _announcement(self, place: Endpoint, own: str = "") -> bytes:
        """Announce of this console as the program at a place has to read it: with the address that it can reach."""
        own = own or own_address(place)
        port = self._data.getsockname()[1]
        return self._packet(self._console.announcement([Service("imc+udp", own, port)]), 0)

    def _packet(self, message: imc.Message, destination: int) -> bytes:
        return imc.encode_with_header(message, time.time(), self._console.id, 0, destination, 0xFF)

    def _send(self, packet: bytes, place: Endpoint) -> None:
        try:
            self._data.sendto(packet, place)
        except OSError as error:
            self._look_for_refusals()
            if error.errno == errno.ECONNREFUSED:  # of an earlier packet; this one was not sent
                with suppress(OSError):
                    self._data.sendto(packet, place)
            elif error.errno == errno.EMSGSIZE:
                self._listener.on_dropped(self, str(place), "too long for a datagram")

    def _look_for_refusals(self) -> None:
        """Systems whose computer reports a closed port have ended."""
        for place in map(Endpoint._make, refused_destinations(self._data)):
            self._refused.add(place)
            self._missed = {id: peer for id, peer in self._missed.items() if peer.endpoint != place}
            for peer in self._everybody():
                if place == peer.endpoint:
                    self._lose(peer, is_reported=True)

    def _everybody(self) -> list[_Peer]:
        return [*self._peers.values(), *self._twins.values()]

    def _lose(self, peer: _Peer, *, is_reported: bool) -> None:
        if self._twins.pop(peer.uid, None) is None:
            self._peers.pop(peer.id, None)
        self._listener.on_vanished(self, peer.name, peer.uid, is_reported=is_reported)

    def _read_announcements(self) -> None:
        assert self._discovery is not None
        for packet, sender in waiting_datagrams(self._discovery, self._look_for_refusals):
            self._take_announcement(packet, sender)

    def _take_announcement(self, packet: bytes, sender: Endpoint) -> None:
        try:
            message = imc.decode(packet)
        except imc.DecodeError as error:
            self._listener.on_dropped(self, sender.address, f"announcement: {error.reason}")
            return
        if not isinstance(message, imc.Announce):
            return
        if message.src != self._console.id:
            self._has_received = True
            self._meet(message, sender)
        elif Services.parse(message.services).uid != self._console.uid:  # a vehicle sends to the newer of us only
            self._rival_received = time.monotonic()
            shared = f"another program at {sender.address} uses the id 0x{self._console.id:04X}"
            self.trouble = f"{shared}: give each program its own (SHOAL_CONSOLE), and list all in Consoles"
            self._listener.on_dropped(self, sender.address, f"another program uses our id 0x{self._console.id:04X}")

    def _meet(self, announce: imc.Announce, sender: Endpoint) -> None:
        services = Services.parse(announce.services)
        name, places = displayable_name(announce.sys_name), services.endpoints("imc+udp", sender.address)
        if not places or not name:
            self._listener.on_dropped(self, name or sender.address, "announced without an address for packets")
            return
        known = self._peers.get(announce.src)
        uid = services.uid or str(announce.src)
        now = time.monotonic()
        if known is not None and known.uid != uid and known.endpoint != places[0] and now - known.seen < SILENCE:
            if len(self._twins) < MOST_PEERS:
                self._twins[uid] = _Peer(announce.src, name, uid, places[0], now)
                self._listener.on_appeared(self, name, uid, f"at {places[0]}", announce.src)
            return
        if known is not None and (known.uid, known.name) != (uid, name):
            self._lose(known, is_reported=True)
            known = None
        if known is None:
            if len(self._peers) >= MOST_PEERS:
                return
            self._twins.pop(uid, None)
            self._missed.pop(announce.src, None)
            known = self._peers[announce.src] = _Peer(announce.src, name, uid, places[0], now)
        known.endpoint, known.announced = places[0], now
        self._listener.on_appeared(self, name, uid, f"at {places[0]}", announce.src)
        self._listener.on_packet(self, ReceivedPacket(imc.encode(announce), name, "", f"at {places[0]}"))
        if not known.received:
            self._greet(known)

    def _greet(self, peer: _Peer) -> None:
        """Send to a system that may find no announcements, and sends only to those who have sent it something."""
        self._send(self._announcement(peer.endpoint), peer.endpoint)
        self._send(self._packet(imc.Heartbeat(), peer.id), peer.endpoint)

    def _read_data(self) -> None:
        for packet, sender in waiting_datagrams(self._data, self._look_for_refusals):
            order = "little" if packet[:1] == b"\x54" else "big"
            if int.from_bytes(packet[2:4], order) == imc.Announce.ID:  # the answer to ours
                self._take_announcement(packet, sender)
                continue
            source = int.from_bytes(packet[14:16], order)
            self._has_received = self._has_received or source != self._console.id
            peer = self._peers.get(source) or self._found_again(source, sender)
            if peer is None:  # damaged in the header, or another protocol
                peer = next((one for one in self._peers.values() if one.endpoint == sender), None)
            if peer is None and self._is_asked(sender):
                now = time.monotonic()
                name = f"0x{source:04X}"
                peer = self._peers[source] = _Peer(source, name, name, sender, now + 1e9)
                self._listener.on_appeared(self, name, name, f"at {sender}", source)
            if peer is None and source in OPERATORS:
                continue  # another console, which greets everybody; its Announce comes every 10 s
            if peer is None:
                self._listener.on_dropped(self, f"0x{source:04X} at {sender.address}", "not announced")
            elif peer.endpoint.address != sender.address:
                self._listener.on_dropped(self, peer.name, f"from {sender.address}, not from {peer.endpoint.address}")
            else:
                peer.received = time.monotonic()
                self._listener.on_packet(self, ReceivedPacket(packet, peer.name, "", f"at {sender}"))

    def _found_again(self, source: int, sender: Endpoint) -> _Peer | None:
        """A system that fell silent and is received again, before it has announced itself again."""
        peer = self._missed.get(source)
        if peer is None or peer.endpoint.address != sender.address:
            return None
        del self._missed[source]
        self._peers[source] = peer
        peer.announced = time.monotonic()
        self._listener.on_appeared(self, peer.name, peer.uid, f"at {peer.endpoint}", source)
        return peer

    def _is_asked(self, sender: Endpoint) -> bool:
        """Whether a system without a name answers where we asked, since no announcement can be received."""
        if len(self._peers) >= MOST_PEERS:
            return False
        return sender in self._places or (self.deaf and sender.address == LOOPBACK and sender.port in USUAL_PORTS)


def _bound_socket(address: str, console: ConsoleIdentity) -> socket.socket:
    """A socket at the port of a console's id, since DUNE never forgets the port that an id had first; or at any."""
    with suppress(OSError, OverflowError):  # also of an id that is none of consoles
        return bound_socket(address, PORTS_OF_CONSOLES + console.id - OPERATORS.start)
    return bound_socket(address, 0)
