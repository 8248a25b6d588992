"""Finds the systems around, by what they announce."""

from dataclasses import dataclass

import imc
from imc.discovery import MULTICAST, PERIOD, PORTS, Services, displayable_name
from imc.reserved_ids import BROADCAST, OPERATORS, UNKNOWN_SYSTEM
from runtime import State, Task, consume, param, periodic
from runtime.network_interfaces import is_loopback_address
from support.duplicate_filter import DuplicateFilter
from support.log_limit import LogLimit, Trouble
from support.token_bucket import TokenBuckets
from tasks.transports.imc_links import peer_table
from tasks.transports.imc_links.datagram_socket_reader import DatagramReader
from tasks.transports.imc_links.peer_table import DropCounts
from tasks.transports.imc_links.recvmmsg import Datagram
from tasks.transports.imc_links.shared_discovery import DiscoveryFollower, DiscoveryLeader
from tasks.transports.imc_links.sockets import (
    check_multicast_address,
    listen_address,
    listen_address_param,
    network_silence,
    network_time,
    open_announce_receivers,
    schedule_network_timer,
)

FORGOTTEN = 4.5 * PERIOD  # s after which a system is no longer within range
MOST_SYSTEMS = 256
MOST_RUNS = 4  # of one id that are distinguished
MOST_SENDERS = 64
RATE = 20.0  # Announces per second from one address of another computer
LOCAL_RATE = 200.0  # from this one, where a fleet may run
NEW_SYSTEMS = 64  # at once from one address, a fleet
NEW_RATE = 2.0  # of them per second in the long run
REMEMBERED = 256  # packets, since each comes by several ways
PULSE = 1.0  # s between two signs of life of the vehicle that listens for all
LONGEST_SILENCE = 5  # of them missing until a follower listens itself
MOST_REFUSALS = 2  # one may come from a vehicle that ends or begins just now
NOT_AN_ANNOUNCE = "no Announce"
TOO_MANY = "of too many new systems"
ANYBODY = "anybody"


@dataclass(slots=True)
class SystemSighting:
    """A system as it announced itself: its name, its run (`uid`), its `place` such as "at 10.0.0.7".

    Its first and last packets arrived at these times (s).
    """

    name: str
    uid: str
    place: str
    first: float
    last: float


class Discovery(Task):
    """Takes the Announces of other systems at the first free port.

    Of the vehicles of one user on a computer only one has a port: it forwards what it receives to the others, and if it
    ends, another takes its place. If it falls silent, the others listen themselves. Each Announce is put on the bus
    once. Two systems that use one id are reported, and another one with the name of this vehicle.
    """

    external = True

    address: str = listen_address_param()
    multicast_address: str = param(MULTICAST, "", "The multicast group.", editable=False)
    ports: list[int] = param(
        list(PORTS),
        "1",
        "Ports to listen at, the first free one.",
        minimum=1,
        maximum=65535,
        size=(1, 16),
        editable=False,
    )

    def configure(self) -> None:
        self.place: str = listen_address(self, self.address)
        check_multicast_address(self.multicast_address)

    def start(self) -> None:
        self.reader: DatagramReader | None = None
        self.leader: DiscoveryLeader | None = None
        self.follower: DiscoveryFollower | None = None
        self.port = self.refusals = 0
        self.trouble: Trouble = Trouble()
        self.drops: DropCounts = DropCounts()
        self.recent: DuplicateFilter = DuplicateFilter(REMEMBERED)
        self.remote_senders: TokenBuckets = TokenBuckets(RATE, RATE, MOST_SENDERS)
        self.local_senders: TokenBuckets = TokenBuckets(LOCAL_RATE, LOCAL_RATE, MOST_SENDERS)
        # By address: a flood from one does not shut out others.
        self.new_systems: TokenBuckets = TokenBuckets(NEW_RATE, NEW_SYSTEMS, MOST_SENDERS)
        self.new_lines: LogLimit = LogLimit("more new systems are within range")
        self.seen: dict[int, list[SystemSighting]] = {}
        self.clashes: dict[str, float] = {}
        self.listen_or_follow()
        schedule_network_timer(self, PULSE, self.pulse_or_check_leader)

    def stop(self) -> None:
        for each in (self.reader, self.leader, self.follower):
            if each is not None:
                each.close()

    def listen_or_follow(self) -> None:
        """Listen for all, or follow the vehicle that does."""
        ports = ",".join(map(str, self.ports))
        name = f"{self.place}-{self.multicast_address}-{ports}"
        try:
            self.leader = DiscoveryLeader(self, name)
        except FileExistsError:
            self.follow(name)
        except OSError:
            self.listen()  # the system cannot do it: a port for each
        else:
            if not self.listen():
                self.leader.close()
                self.leader = None

    def follow(self, name: str) -> None:
        try:
            self.follower = DiscoveryFollower(self, name, self.on_packet, self.lose_leader)
        except PermissionError:
            self.listen()  # somebody else's program: do not rely on it
        except OSError:
            self.listen_after_refusals()

    def listen(self, why: str = "") -> bool:
        """Open the first free port; if there is none, or it is a second choice, the reason is logged once."""
        reason = ""
        for port in self.ports:
            try:
                sockets = open_announce_receivers(self.place, port, self.multicast_address)
            except OSError as error:
                reason = f"{self.place}: {error.strerror}: ports {', '.join(map(str, self.ports))}"
                continue
            if why:
                self.log.warning(f"{why}: listens itself, at port {port}")
            self.port: int = port
            self.reader = DatagramReader(self, sockets, self.on_datagrams)
            self.trouble.end()
            return True
        reason = f"{why}; {reason}" if why else reason
        text = f"receives no announcements, so systems have to announce themselves at its UDP port: {reason}"
        self.trouble.report(reason, self.log.warning, text)
        return False

    def lose_leader(self) -> None:
        """Take the place of the one that has ended; one that ends without a word has no room for us."""
        welcome = self.follower is not None and self.follower.welcome
        self.follower = None
        if welcome:
            self.refusals = 0
            self.listen_or_follow()
        else:
            self.listen_after_refusals()

    def listen_after_refusals(self) -> None:
        self.refusals += 1
        if self.refusals >= MOST_REFUSALS:
            self.listen("the program that listens for all accepts no more")

    def pulse_or_check_leader(self) -> None:
        """Send followers a sign of life, or listen if there is no leader."""
        schedule_network_timer(self, PULSE, self.pulse_or_check_leader)
        if self.leader is not None:
            self.leader.pulse()
        elif self.follower is not None:
            self.check_leader(self.follower)
        elif self.reader is None:
            self.listen_or_follow()

    def check_leader(self, leader: DiscoveryFollower) -> None:
        """Follow no longer if the leader is silent, except where there is no port left."""
        if leader.count_silence() > LONGEST_SILENCE:
            if self.listen("the vehicle that listens for all is silent"):
                leader.close()
                self.follower = None
        elif leader.welcome:
            self.trouble.end()
            self.refusals: int = 0

    def on_datagrams(self, datagrams: list[Datagram]) -> None:
        for packet, address, _ in datagrams:
            self.on_packet(packet, address)

    def on_packet(self, packet: bytes, address: str) -> None:
        """Put an Announce on the bus, unless it came before or is this vehicle's own."""
        if not self.try_acquire(address):
            self.report_drop(peer_table.TOO_FAST, address)
            return
        if self.recent.is_duplicate(packet):
            return
        try:
            message = self.vehicle.bus.decode(packet)
        except imc.DecodeError as error:
            self.report_drop(peer_table.MALFORMED, address, error.reason)
            return
        if not isinstance(message, imc.Announce) or message.src in (0, BROADCAST, UNKNOWN_SYSTEM):
            self.report_drop(NOT_AN_ANNOUNCE, address, type(message).__name__)
            return
        is_new = message.src not in self.seen and message.src != self.system
        if is_new and not self.try_acquire_new(address):
            if self.drops.add(TOO_MANY, ANYBODY):
                self.log.warning(f"announcements of new systems dropped: too many, the first from {address}")
            return
        if self.leader is not None:
            self.leader.forward(address, packet)
        services, name = Services.parse(message.services), displayable_name(message.sys_name)
        if message.src == self.system:
            if services.uid != str(round(self.vehicle.start_time * 1e9)):
                self.report_conflict(f"the id 0x{message.src:04X} of this vehicle", f"{name} at {address}")
            return
        if name == self.vehicle.name:
            self.report_conflict(f"the name {name} of this vehicle", f"0x{message.src:04X} at {address}")
        self.record_sighting(message.src, name, services.uid, f"at {address}")
        if not self.vehicle.bus.is_system_on_transport(message.src):
            self.relay(packet)

    @consume(others=True)
    def on_console(self, other: imc.Announce) -> None:
        """Note a console that has come over zenoh or TCP, where Announces only name it."""
        services = Services.parse(other.services)
        if services.console_network and other.src in OPERATORS and self.try_acquire_console(other.src):
            place = f"over {displayable_name(services.console_network)}"
            self.record_sighting(other.src, displayable_name(other.sys_name), services.uid, place)

    def try_acquire_console(self, system: int) -> bool:
        """Whether a console that came by another network may be noted: known ones always, few new ones at a time."""
        return system in self.seen or self.try_acquire_new(ANYBODY)

    def try_acquire(self, address: str) -> bool:
        """Whether an address may send one more."""
        senders = self.local_senders if is_loopback_address(address) else self.remote_senders
        return senders[address].try_acquire(network_time(self))

    def try_acquire_new(self, address: str) -> bool:
        """Whether an address may announce one more new system."""
        return self.new_systems[address].try_acquire(network_time(self))

    def record_sighting(self, system: int, name: str, uid: str, place: str) -> None:
        """Remember who uses an id; two that use it by turns are two systems, one after the other a restart."""
        if system not in self.seen and len(self.seen) >= MOST_SYSTEMS:
            del self.seen[min(self.seen, key=lambda each: max(s.last for s in self.seen[each]))]
        runs = self.seen.setdefault(system, [])
        found = next((run for run in runs if (run.name, run.uid) == (name, uid)), None)
        if found is None:
            if not runs:
                text = f"new system within range: {name} (0x{system:04X}) {place}"
                self.new_lines.write(self.log.info, text, network_time(self))
            found = SystemSighting(name, uid, place, network_time(self), network_time(self))
            runs.append(found)
            del runs[:-MOST_RUNS]
        found.last, found.place = network_time(self), place
        for other in runs:
            if other is not found and other.last > found.first and network_time(self) > other.first:
                both = f"{other.name} {other.place} and {name} {place}"
                self.report_conflict(f"the id 0x{system:04X}", both)

    def report_conflict(self, what: str, who: str) -> None:
        """Report once, and in the state of the entity, that two systems use one id or name."""
        clash = f"{what} is also used by {who}"
        if clash not in self.clashes:
            if len(self.clashes) >= MOST_SENDERS:
                return
            self.log.error(f"{clash}: give one of them another {what.split()[1]}")
        self.clashes[clash] = network_time(self)

    def report_drop(self, reason: str, address: str, why: str = "") -> None:
        if self.drops.add(reason, address):
            self.log.warning(f"announcement from {address} dropped: {reason}" + (f" ({why})" if why else ""))

    @periodic(1.0)
    def report_systems(self) -> None:
        """Forget who is out of range, and report who is within."""
        self.drops.merge_inactive(network_time(self))
        for system, runs in list(self.seen.items()):
            runs[:] = [run for run in runs if network_silence(self, run.last) < FORGOTTEN]
            if not runs:
                del self.seen[system]
        self.clashes = {clash: last for clash, last in self.clashes.items() if network_silence(self, last) < FORGOTTEN}
        names = ", ".join(sorted(run.name for runs in self.seen.values() for run in runs))
        figures = [f"{len(self.seen)} systems within range" + (f": {names}" if names else ""), str(self.drops)]
        state = State.FAULT if self.trouble.reason or self.clashes else State.NORMAL
        self.set_entity_state(state, "; ".join(filter(None, (self.trouble.reason, *self.clashes, *figures))))
