"""IMC over UDP, for Neptus, DUNE, imcjava and imcpy."""

from collections.abc import Collection, Iterable
from socket import socket

import imc
from imc.console_acl import NOT_LISTED, REPORTS
from imc.discovery import Endpoint, Service, Services
from imc.reserved_ids import BROADCAST, UNKNOWN_SYSTEM
from runtime import State, consume, periodic
from runtime.network_interfaces import enable_icmp_errors, refused_destinations
from runtime.udp_sockets import bind_udp_socket
from support.duplicate_filter import DuplicateFilter
from support.log_limit import LogLimit, Trouble
from tasks.transports.imc_links.datagram_filter import ANNOUNCE, SPOOFED, sender_text
from tasks.transports.imc_links.datagram_link import DatagramLinkTask
from tasks.transports.imc_links.datagram_socket_reader import DatagramReader
from tasks.transports.imc_links.large_answers import LargeAnswers
from tasks.transports.imc_links.peer_table import (
    MALFORMED,
    MOST_PEERS,
    ON_THE_BUS,
    UNKNOWN,
    DropCounts,
    Peer,
)
from tasks.transports.imc_links.port_search import announce_listening_service, candidate_ports
from tasks.transports.imc_links.recvmmsg import Datagram
from tasks.transports.imc_links.sockets import BUFFER, network_time, send_packet
from tasks.transports.imc_links.stream_links import StreamLinkTask

PORTS_TRIED = 5  # from Local Port on, as in DUNE
OUT_OF_RANGE = "out of range"
NOTED = frozenset({ANNOUNCE, imc.ImageTxSettings.ID})  # what this task itself has to know
BREAK = 1.0  # s between two greetings of one system
REPEATS = 1024  # forwarded packets that are remembered
WHY = {
    MALFORMED: "it is no packet of IMC",
    UNKNOWN: "it has to send an Announce first",
    SPOOFED: "it sends our packets back, or is a second vehicle with our id",
    NOT_LISTED: "see Consoles",
}


class UDP(DatagramLinkTask):
    """Exchanges IMC packets with systems that announce themselves, and with static destinations.

    A system gets packets as soon as it has announced itself and sent one, until it is silent for `Contact Timeout`; it
    may move to another address or port. Another vehicle gets none unless `Call Systems` names it. A packet is put on
    the bus only if its system has announced the address that it comes from, or if it is an Abort for this vehicle.
    Nothing goes back to its sender, and nothing is forwarded twice. A system that also sends by a TCP connection from
    the same address gets there what that link lists, and only the rest over UDP.
    """

    def start(self) -> None:
        self.drops: DropCounts = DropCounts()
        self.unsent: DropCounts = DropCounts()
        self.taken: int = 0
        self.missed: int = 0
        self.port: int = 0
        # Two vehicles that forward would send a packet for ever.
        self.forwarded: DuplicateFilter = DuplicateFilter(REPEATS)
        self.streams: list[StreamLinkTask] = [task for task in self.vehicle.tasks if isinstance(task, StreamLinkTask)]
        self.socket: socket | None = None
        self.reader: DatagramReader | None = None
        self.trouble: Trouble = Trouble()
        self.contact_lines: LogLimit = LogLimit("more systems come into contact, or lose it")
        super().start()
        self.open()

    def stop(self) -> None:
        if self.reader is not None:
            self.reader.close()
        self.reader = self.socket = None

    def refresh_subscriptions(self) -> None:
        """Find out the destinations, and the list for each."""
        contacts = self.peers.contacts(network_time(self)) if self.dynamic_nodes else []
        self.routes.update(
            (peer.system, endpoint) for peer, endpoint in contacts if not self.vehicles.withholds(peer.system)
        )
        self.set_subscriptions_enabled(bool(self.routes))

    def goes_by_stream(self, system: int, address: str, kind: int) -> bool:
        """Whether a system that is connected by TCP, too, gets this vehicle's messages of a type, by its id, there.

        One that `Peer Rates` names gets everything at these rates over UDP.
        """
        return system not in self.routes.lists and any(
            kind in task.sent_ids and task.serves(system, address) for task in self.streams
        )

    def open(self) -> None:
        """Listen, at the first port that is free; if that fails, the reason is logged once."""
        reason = ""
        for port in candidate_ports(self.local_port, PORTS_TRIED):
            try:
                self.socket = bind_udp_socket(self.place, port, BUFFER)
            except OSError as error:
                reason = f"cannot listen at {self.place}: {error.strerror}"
                continue
            self.trouble.end()
            self.port = self.socket.getsockname()[1]
            enable_icmp_errors(self.socket)
            self.reader = DatagramReader(self, [self.socket], self.on_datagrams, self.remove_unreachable_peers)
            service = Service("imc+udp", self.place, self.port)
            announce_listening_service(
                self, service, self.local_port, self.commanders.risk, announced=self.announce_service
            )
            self.refresh_subscriptions()
            return
        self.trouble.report(reason, self.log.error)

    @consume(others=True)
    def on_announce(self, other: imc.Announce) -> None:
        """Take up a system, or where it is now."""
        changed = self.vehicles.on_announce(other)
        if changed and other.src == self.system:
            self.refresh_subscriptions()
        services = Services.parse(other.services)
        is_elsewhere = services.console_network or self.vehicle.bus.is_system_on_transport(other.src)
        if other.src in (self.system, 0, BROADCAST, UNKNOWN_SYSTEM) or is_elsewhere:
            return
        peer = self.peers.on_announce(other.src, other.sys_name, services, network_time(self))
        self.positions.on_announce(other)
        if peer is None:
            if self.drops.add("announced beyond the systems in contact", f"0x{other.src:04X}"):
                self.log.warning(f"{MOST_PEERS} systems are in contact: there is no room for 0x{other.src:04X}")
        elif self.peers.is_in_contact(peer, network_time(self)):
            self.refresh_subscriptions()

    def on_datagrams(self, datagrams: list[Datagram]) -> None:
        """Put packets on the bus, if they may come from where they come."""
        bus, judge, reach, now = self.vehicle.bus, self.gate.evaluate, self.reach, network_time(self)
        decode, publish, forwards, taken = bus.decode_first, bus.deliver_and_send, not self.local_messages_only, 0
        before, place = None, ""  # whose packet came before, and from where
        for datagram, address, port in datagrams:
            try:
                peer = judge(datagram, address, port, now)
                if isinstance(peer, str):
                    peer = self.drop_unless_announce(datagram, address, port, peer)
                    if peer is None:
                        continue
                if reach is not None and not reach.reaches(peer.system, imc.packet_id(datagram)):
                    self.drops.add(OUT_OF_RANGE, peer.name)
                    continue
                message, packet = decode(datagram)
            except imc.DecodeError as error:
                self.report_drop(MALFORMED, sender_text(datagram, address), error.reason)
                continue
            publish(message, packet, self)
            kind = message.ID
            taken += 1
            if kind not in REPORTS:
                peer.commands = True
            if forwards:
                self.transmit(message, packet)
            if peer is before and address is place and kind not in NOTED:
                continue  # most packets of a burst need no more than this
            before, place = peer, address
            if isinstance(message, imc.Announce):
                self.on_announce(message)
            elif isinstance(message, imc.ImageTxSettings):
                self.large_answers.on_request(message, now, address)
            peer.received_at, peer.taken = now, True
            if peer.source == address:
                peer.last_from_source = now
            elif not peer.is_secondary_address(address, now):
                self.update_destination(peer, address, now)
        self.taken += taken

    def update_destination(self, peer: Peer, address: str, now: float) -> None:
        """Send to where a system is now; a new place is greeted, but not so often that it could be a nuisance there."""
        new = address not in peer.sources
        peer.set_source(address, now)
        self.refresh_subscriptions()
        if now - peer.answered_at >= BREAK:
            peer.answered_at = now
            self.log_contact(f"in contact with {peer.name} (0x{peer.system:04X}) at {peer.endpoint or address}")
            if self.vehicles.withholds(peer.system):
                self.log_contact(
                    f"{peer.name} is another vehicle and gets nothing, since Call Systems does not name it"
                )
            elif new:
                self.send_last_states(peer)

    def log_contact(self, text: str) -> None:
        self.contact_lines.write(self.log.info, text, network_time(self))

    def send_last_states(self, peer: Peer) -> None:
        """Send a new system the last states, which it would have to wait for."""
        if self.dynamic_nodes and peer.endpoint is not None:
            for packet in self.last_states(self.routes.messages(peer.system)):
                kind = imc.packet_id(packet)
                if self.goes_by_stream(peer.system, peer.endpoint.address, kind):
                    continue
                if self.reach is None or self.reach.reaches(peer.system, kind):
                    self.send_to_endpoint(packet, peer.endpoint)

    def keep_state(self, state: imc.Message, packet: bytes) -> None:
        super().keep_state(state, packet)
        if isinstance(state, imc.EstimatedState):
            self.positions.on_own_state(state)

    def drop_unless_announce(self, packet: bytes, address: str, port: int, reason: str) -> Peer | None:
        """Drop a packet, unless it is the Announce that makes its system a peer."""
        if reason is UNKNOWN and self.vehicle.bus.is_system_on_transport(imc.packet_source(packet)):
            self.drops.add(ON_THE_BUS, sender_text(packet, address))
            return None
        if self.gate.is_unknown_sender_announce(packet, reason, network_time(self)):
            announce = self.vehicle.bus.decode(packet)
            if isinstance(announce, imc.Announce):
                self.on_announce(announce)
                peer = self.gate.evaluate(packet, address, port, network_time(self))
                if isinstance(peer, Peer):
                    return peer
                reason = peer
        self.report_drop(reason, sender_text(packet, address), WHY.get(reason, ""))
        if reason is NOT_LISTED:
            self.answer_unlisted(packet)
        return None

    def answer_unlisted(self, packet: bytes) -> None:
        """Send a console the reason why its order is rejected, where it takes packets."""
        peer = self.peers.find(imc.packet_source(packet))
        if self.socket is None or peer is None or peer.endpoint is None or self.vehicles.withholds(peer.system):
            return
        if answer := self.refusals.answer(packet, self.now):
            self.send_to_endpoint(answer, peer.endpoint)

    def report_drop(self, reason: str, who: str, why: str) -> None:
        """Count a datagram that is not taken, and name the first of each sender."""
        if self.drops.add(reason, who):
            write = self.log.info if reason is UNKNOWN else self.log.warning
            write(f"packet from {who} dropped: {reason}" + (f" ({why})" if why else ""))

    def sent_types(self) -> Iterable[type[imc.Message]]:
        return self.routes.types

    def transmit(self, message: imc.Message, packet: bytes) -> None:
        source, now = message.src, network_time(self)
        if self.socket is None or (source != self.system and self.forwarded.is_duplicate(packet)):
            return
        own, kind = source == self.system, message.ID
        receivers = self.large_answers.receivers(message, now) if kind in LargeAnswers.ids else None
        for system, endpoint in self.routes.destinations(message, now):
            if system == source or (own and self.goes_by_stream(system, endpoint.address, kind)):
                continue
            if receivers is not None and not self.is_among(receivers, system):
                continue
            if self.reach is None or self.reach.reaches(system, kind):
                self.send_to_endpoint(packet, endpoint)

    def is_among(self, receivers: Collection[int], system: int) -> bool:
        """Whether a system is one of `receivers`; a static destination may be any that is not reached otherwise."""
        if system != UNKNOWN_SYSTEM:
            return system in receivers
        return any(self.peers.find(s) is None and not self.vehicle.bus.is_system_on_transport(s) for s in receivers)

    def send_to_endpoint(self, packet: bytes, endpoint: Endpoint) -> None:
        """Send a packet; one that cannot be sent is counted, and the first of each place and reason named."""
        assert self.socket is not None
        try:
            send_packet(self.socket, packet, endpoint)
        except OSError as error:
            why = error.strerror or str(error)
            if self.unsent.add(f"not sent ({why})", str(endpoint)):
                self.log.warning(f"packets cannot be sent to {endpoint}: {why}")

    def remove_unreachable_peers(self) -> None:
        """End the contact with those whose programs have ended: their computers reject packets."""
        assert self.socket is not None
        for place in set(map(Endpoint._make, refused_destinations(self.socket))):
            for peer in self.peers.on_port_unreachable(place, network_time(self)):
                self.log_contact(f"lost contact with {peer.name} (0x{peer.system:04X}): nothing listens at {place}")
                self.refresh_subscriptions()

    @periodic(1.0)
    def tick(self) -> None:
        """Forget who is silent, and report who is in contact and what was dropped."""
        if self.reader is None:
            self.open()
        elif (missed := self.reader.missed) != self.missed:
            if not self.missed:
                self.log.warning("packets come faster than they can be read: some are lost")
            self.missed: int = missed
        self.drops.merge_inactive(network_time(self))
        self.unsent.merge_inactive(network_time(self))
        moved, lost = (
            self.peers.remove_reached(self.vehicle.bus.is_system_on_transport),
            self.peers.remove_silent(network_time(self)),
        )
        for peer in moved:
            self.log.info(f"{peer.name} (0x{peer.system:04X}) is on the zenoh bus, and no longer in contact over UDP")
        for peer in lost:
            self.log_contact(f"lost contact with {peer.name} (0x{peer.system:04X})")
        if moved or lost:
            self.refresh_subscriptions()
        contacts = [self.contact_text(peer, endpoint) for peer, endpoint in self.peers.contacts(network_time(self))]
        listed = f" ({', '.join(contacts)})" if contacts else ""
        figures = [self.trouble.reason, f"{len(contacts)} in contact{listed}"]
        figures += [f"{self.taken} packets taken", str(self.drops), str(self.unsent)]
        figures += [f"{self.missed} came too fast to be read"] if self.missed else []
        self.set_entity_state(State.ERROR if self.trouble.reason else State.NORMAL, "; ".join(filter(None, figures)))

    def contact_text(self, peer: Peer, endpoint: Endpoint) -> str:
        """A system in contact, for the entity's state."""
        if self.vehicles.withholds(peer.system):
            return f"{peer.name} at {endpoint}, gets nothing"
        by_tcp = any(task.serves(peer.system, endpoint.address) for task in self.streams)
        return f"{peer.name} at {endpoint}{', also by TCP' if by_tcp else ''}"
