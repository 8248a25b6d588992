"""Announces this vehicle, its position and its services to other systems."""

from collections.abc import Iterable, Sequence

import imc
from imc.discovery import (
    BROADCAST,
    LOOPBACK,
    MULTICAST,
    PERIOD,
    PORTS,
    VEHICLE_TYPES,
    Endpoint,
    Service,
    Services,
    announce_targets,
    message_services,
)
from imc.reserved_ids import OPERATORS
from runtime import State, Task, consume, param, periodic
from runtime.network_interfaces import EVERYWHERE, Interface, interfaces, is_loopback_address
from tasks.transports.imc_links.own_announce import (
    SYSTEM_TYPES,
    announcement,
    custom_message_signatures,
    expand_any_transport,
    external_services,
    loopback_services,
)
from tasks.transports.imc_links.sockets import (
    check_multicast_address,
    listen_address,
    network_time,
    open_announce_sender,
    schedule_network_timer,
)

SHORTEST = 1.2  # s between two announcements; imcjava ignores one that comes within a second
SOON = 0.2  # s, for several services that begin together
MOST_SERVICES = 64
MOST_SYSTEMS = 64
BREAK = 0.05  # s between two answers to newcomers, who may claim any address


class Announce(Task):
    """Sends Announce to the loopback address, and with another `Address` to the networks of this computer.

    There it goes to the multicast group, to all by broadcast, and to the addresses of consoles that have announced
    themselves: another vehicle that receives it at its port would send its data. It goes out every `Announcement
    Periodicity`, and at once when a service begins or a system appears. The services are those of which tasks publish
    an AnnounceService. One at 0.0.0.0 is announced at each address of this computer, one at another address as it is; a
    later one of the same entity, scheme and path replaces it.
    """

    external = True

    address: str = param(
        "",
        "",
        "Destination of announcements; empty means [General] Network Address: 127.0.0.1 is this computer only.",
        editable=False,
    )
    announcement_periodicity: float = param(
        PERIOD, "s", "Time between two announcements, 1.2 s at least.", minimum=0, editable=False
    )
    system_type: str = param("uuv", "", "Kind of system.", choices=SYSTEM_TYPES)
    enable_loopback: bool = param(True, "", "Announce to this computer.", editable=False)
    enable_multicast: bool = param(True, "", "Announce to the multicast group.", editable=False)
    enable_broadcast: bool = param(True, "", "Announce by broadcast.", editable=False)
    multicast_address: str = param(MULTICAST, "", "The multicast group.", editable=False)
    ports: list[int] = param(
        list(PORTS), "1", "Ports that systems listen on.", minimum=1, maximum=65535, size=(1, 16), editable=False
    )
    ignored_interfaces: list[str] = param([], "", "Names of interfaces that are not used.", editable=False)

    def configure(self) -> None:
        self.place: str = listen_address(self, self.address)
        check_multicast_address(self.multicast_address)
        self.is_vehicle: bool = imc.SystemType[self.system_type.upper()] in VEHICLE_TYPES

    def start(self) -> None:
        self.state: imc.EstimatedState | None = None
        self.offered: dict[tuple[int, str, str], tuple[Service, int]] = {}
        self.systems: dict[int, tuple[str, tuple[str, ...]]] = {}  # uid or name, and addresses, by id
        self.answered = 0.0
        self.unanswered: dict[int, Sequence[Endpoint]] = {}
        self.sent, self.due, self.asked = 0.0, network_time(self) + SHORTEST, False  # first come the services

    @consume
    def on_announce_service(self, offer: imc.AnnounceService) -> None:
        """Take up a service of this vehicle."""
        try:
            service = Service.parse(offer.service)
        except ValueError as error:
            self.log.warning(f"not announced: {error}")
            return
        if len(self.offered) < MOST_SERVICES:
            self.offered[offer.src_ent, service.scheme, service.path] = (service, offer.service_type)
            self.announce_soon()

    @consume
    def on_estimated_state(self, state: imc.EstimatedState) -> None:
        self.state = state

    @consume(others=True)
    def answer_new_system(self, other: imc.Announce) -> None:
        """Announce to a system that has just appeared: at once where it takes packets, and soon to all."""
        if other.src == self.system:
            return
        services = Services.parse(other.services)
        places = services.endpoints("imc+udp")
        addresses = tuple(dict.fromkeys(end.address for end in places))
        who = services.uid or other.sys_name
        is_console = other.sys_type == imc.SystemType.CCU or other.src in OPERATORS
        if self.is_vehicle and not is_console:
            places, addresses = (), ()
        before = self.systems.pop(other.src, None)
        if len(self.systems) >= MOST_SYSTEMS:
            del self.systems[next(iter(self.systems))]
        self.systems[other.src] = (who, addresses)
        if before is None or before[0] != who:
            self.announce_soon()
            if places and self.offered and len(self.unanswered) < MOST_SYSTEMS:
                self.unanswered[other.src] = places
                if len(self.unanswered) == 1:
                    self.answer_waiting()
        elif other.src in self.unanswered and places:
            self.unanswered[other.src] = places

    def answer_waiting(self) -> None:
        """Announce to the newcomer that has waited longest, and later to the others."""
        wait = self.answered + BREAK - network_time(self)
        if wait <= 0:
            self.answered: float = network_time(self)
            wait = BREAK
            self.announce_to_system(self.unanswered.pop(next(iter(self.unanswered))))
        if self.unanswered:
            schedule_network_timer(self, wait, self.answer_waiting)

    def announce_to_system(self, places: Iterable[Endpoint]) -> None:
        """Announce to one system, where our own address reaches it: from loopback that is this computer only."""
        offered, confined = self.offered.values(), is_loopback_address(self.place)
        here = {each.address for each in interfaces()} if confined else set[str]()
        for place in places:
            local = is_loopback_address(place.address) or place.address in here
            if local or not confined:
                own = [network.address for network in self.announcement_interfaces()]
                if services := loopback_services(offered) if local else external_services(offered, own):
                    self.send("", self.build_announce(services), [place])
                return

    def announce_soon(self) -> None:
        if not self.asked:
            self.asked = True
            wait = max(SOON, self.sent + SHORTEST - network_time(self))
            schedule_network_timer(self, wait, self.announce)

    @periodic(1.0)
    def keep_announcing(self) -> None:
        if network_time(self) >= self.due:
            self.announce()

    def announce(self) -> None:
        """Send the local announcement on this computer, and the public one to the networks."""
        self.asked: bool = False
        self.sent: float = network_time(self)
        self.due: float = self.sent + max(SHORTEST, self.announcement_periodicity)
        offered = list(self.offered.values())
        message = self.build_announce(loopback_services(offered))
        troubles = self.send("", message, announce_targets([LOOPBACK] if self.enable_loopback else [], self.ports))
        if not is_loopback_address(self.place):
            used = self.announcement_interfaces()
            message = self.build_announce(external_services(offered, [network.address for network in used]))
            for network in used:
                reach = [self.multicast_address] if self.enable_multicast else []
                reach += [network.broadcast] if self.enable_broadcast and network.broadcast else []
                troubles |= self.send(network.address, message, announce_targets(reach, self.ports))
            others = [BROADCAST] if self.enable_broadcast else []
            others += self.known_addresses(network.address for network in used)
            self.send("", message, announce_targets(others, self.ports))  # fails where there is no route to others
            troubles |= set() if used else {f"no network has the address {self.place}"}
        self.publish(message)
        figures = f"{len(offered)} services, {len(self.systems)} systems around"
        self.set_entity_state(State.FAULT if troubles else State.NORMAL, "; ".join([*sorted(troubles), figures]))

    def announcement_interfaces(self) -> list[Interface]:
        """The interfaces that announcements go out by."""
        return [
            each
            for each in interfaces()
            if not each.is_loopback
            and each.name not in self.ignored_interfaces
            and self.place in (EVERYWHERE, each.address)
        ]

    def known_addresses(self, own: Iterable[str]) -> list[str]:
        """The addresses of other computers' systems, which multicast may not reach."""
        mine = set(own)
        found = dict.fromkeys(address for _, addresses in self.systems.values() for address in addresses)
        return [address for address in found if address not in mine and not is_loopback_address(address)]

    def build_announce(self, services: Iterable[Service]) -> imc.Announce:
        uid = round(self.vehicle.start_time * 1e9)
        schema = self.vehicle.bus.messages
        known = (*expand_any_transport(services), *message_services(custom_message_signatures(schema)))
        text = str(Services.from_system_info(known, uid=uid, version="shoal", imc=schema.version))
        return announcement(self.system_name, self.system_type, self.state, text).replace(dst=0)

    def send(self, by: str, message: imc.Announce, places: Sequence[Endpoint]) -> set[str]:
        """Send to each place, to a group by the interface with the address `by`; returns what went wrong."""
        packet = imc.encode_with_header(message, self.now, self.system, self.entity.id, message.dst, message.dst_ent)
        troubles: set[str] = set()
        with open_announce_sender(by) as opened:
            for place in places:
                try:
                    opened.sendto(packet, place)
                except OSError as error:
                    troubles.add(f"{place.address}: {error.strerror}")
        return troubles
