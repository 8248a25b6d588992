"""The systems that a vehicle exchanges datagrams with: who announced itself, from where it may send, and where to."""

import math
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass, field
from ipaddress import IPv4Address

from imc.discovery import PERIOD, Endpoint, Services, displayable_name
from support.token_bucket import TokenBucket

MOST_PEERS = 64
SHARE = MOST_PEERS // 4  # of one address; beyond it, its peers are the first to give way
QUIET = 2.0  # s; a peer that sends Heartbeat is not silent for so long, even if its port refuses what it is sent
MOST_ADDRESSES = 16  # of one peer
STAY = 1.0  # s without a datagram from an address until one from an earlier one counts more
KEPT = 4.5 * PERIOD  # s that an address counts after it was announced last
MISSED = 600.0  # s that a system which was in contact may be silent, and come back without an Announce
MOST_NAMED = 64  # senders whose drops are counted by name
NAMED = 300.0  # s
OTHERS = "others"

UNKNOWN = "not announced"
ELSEWHERE = "from an address that it did not announce"
TOO_FAST = "too fast"
MALFORMED = "malformed"
ON_THE_BUS = "came over zenoh, too"


@dataclass(slots=True)
class Peer:
    """A system that has announced itself: `addresses` are its ports by address, and when they were announced (s).

    `source` is where its datagrams come from, None before the first; `received_at` is when the last one arrived,
    `last_from_source` when the last one came from `source` (s). `sources` are the addresses that it was seen at,
    `answered_at` is when it was greeted (s).
    `taken` is whether a packet of it has reached the bus, `commands` whether it has sent more than reports.
    """

    system: int
    name: str
    bucket: TokenBucket  # of its datagrams
    uid: str = ""
    addresses: dict[str, tuple[int, float]] = field(default_factory=dict[str, tuple[int, float]])
    announced: float = -math.inf
    source: str | None = None
    received_at: float = -math.inf
    last_from_source: float = -math.inf
    sources: dict[str, None] = field(default_factory=dict[str, None])
    answered_at: float = -math.inf
    taken: bool = False
    commands: bool = False

    @property
    def endpoint(self) -> Endpoint | None:
        """The address to send to: the source of its datagrams, else the first announced one; at the announced port."""
        here = self.addresses.get(self.source) if self.source else None
        if here is None:
            here = next((place for place in self.addresses.values() if place[0]), None)
        if here is None or not here[0]:
            return None
        address = self.source or next(each for each, place in self.addresses.items() if place is here)
        return Endpoint(address, here[0])

    def is_secondary_address(self, address: str, now: float) -> bool:
        """Whether the peer is still at another address that it sends from by turns, rather than now at this one."""
        return address in self.sources and now - self.last_from_source < STAY

    def set_source(self, address: str, now: float) -> None:
        """Note that it is at an address now."""
        self.source, self.last_from_source = address, now
        self.sources[address] = None
        if len(self.sources) > MOST_ADDRESSES:
            del self.sources[next(iter(self.sources))]


def seconds_between(since: float, now: float) -> float:
    return now - since


class PeerTable:
    """The peers of one vehicle, at most 64. If there are more, another one gives way: one that is not in contact, or of
    an address with more than its share, or that never commanded, or the longest silent; none in `kept` or `called`.

    A peer is in contact until it is silent for `timeout` seconds; those in `called` need not send anything first.
    Each may send `rate` datagrams per second, and as many at once after a pause.
    `silence(since, now)` is for how long (s) nothing came although it could have been received.

    A datagram is taken from an address that its system has announced. A sender on the loopback interface is on this
    computer for any announced addresses. A system that announces no address may send from any.
    """

    def __init__(
        self,
        kept: Collection[int] = (),
        called: Collection[int] = (),
        timeout: float = 30.0,
        rate: float = 2000.0,
        silence: Callable[[float, float], float] = seconds_between,
    ):
        self.kept: Collection[int] = kept
        self.called: Collection[int] = called
        self.timeout: float = timeout
        self.rate: float = rate
        self._silence = silence
        self.by_id: dict[int, Peer] = {}
        self._gone: list[Peer] = []  # from contact, for others

    def __iter__(self) -> Iterator[Peer]:
        return iter(self.by_id.values())

    def __len__(self) -> int:
        return len(self.by_id)

    def find(self, system: int) -> Peer | None:
        return self.by_id.get(system)

    def on_announce(self, system: int, name: str, services: Services, now: float) -> Peer | None:
        """Take an Announce: where the system is. None if there is no room for one more."""
        peer = self.by_id.get(system)
        if peer is None:
            if len(self.by_id) >= MOST_PEERS and not self._make_room(now):
                return None
            peer = self.by_id[system] = Peer(system, displayable_name(name), TokenBucket(self.rate, self.rate))
        if services.uid and services.uid != peer.uid:  # it has started again, maybe elsewhere
            peer.uid, peer.addresses, peer.sources = services.uid, {}, {}
        peer.name, peer.announced = displayable_name(name), now
        for address in dict.fromkeys(service.address for service in services.each if _is_host(service.address)):
            peer.addresses.setdefault(address, (0, now))
            peer.addresses[address] = (peer.addresses[address][0], now)
        for end in reversed(services.endpoints("imc+udp")):
            peer.addresses[end.address] = (end.port, now)
        fresh = [item for item in peer.addresses.items() if self._silence(item[1][1], now) < KEPT]
        fresh.sort(key=lambda item: item[1][1], reverse=True)
        peer.addresses = dict(fresh[:MOST_ADDRESSES])
        return peer

    def identify_sender(self, system: int, address: str, now: float) -> Peer | str:
        """The peer that a datagram is from; else why it is not taken."""
        peer = self.by_id.get(system)
        if peer is None:
            return UNKNOWN
        if peer.addresses and address not in peer.addresses and not address.startswith("127."):
            return ELSEWHERE
        return peer if peer.bucket.try_acquire(now) else TOO_FAST

    def contacts(self, now: float) -> list[tuple[Peer, Endpoint]]:
        """The peers that are in contact and can be sent to, and where."""
        each = [(peer, peer.endpoint) for peer in self.by_id.values() if self.is_in_contact(peer, now)]
        return [(peer, endpoint) for peer, endpoint in each if endpoint is not None]

    def is_in_contact(self, peer: Peer, now: float) -> bool:
        return peer.system in self.called or (
            peer.source is not None and self._silence(peer.received_at, now) <= self.timeout
        )

    def remove_silent(self, now: float) -> list[Peer]:
        """Forget those who neither announced nor sent anything for long; returns those whose contact was lost."""
        lost = [peer for peer in self.by_id.values() if peer.source is not None and not self.is_in_contact(peer, now)]
        self._part(lost)
        silent = [
            system
            for system, peer in self.by_id.items()
            if peer.source is None and self._silence(peer.announced, now) > (MISSED if peer.taken else KEPT)
        ]
        for system in silent:
            del self.by_id[system]
        gone, self._gone = self._gone, []
        return gone + lost

    def on_port_unreachable(self, place: Endpoint, now: float) -> list[Peer]:
        """Note an address where nothing listens any more; returns its silent peers, which are no longer in contact."""
        each = self.by_id.values()
        there = [peer for peer in each if peer.source is not None and peer.endpoint == place]
        lost = [peer for peer in there if self._silence(peer.received_at, now) > QUIET]
        self._part(lost)
        return lost

    def _part(self, lost: Iterable[Peer]) -> None:
        for peer in lost:
            peer.source = None
            peer.sources.clear()

    def remove_reached(self, reached: Callable[[int], bool]) -> list[Peer]:
        """Forget the systems that are reached by another way; returns them."""
        moved = [peer for system, peer in self.by_id.items() if reached(system)]
        for peer in moved:
            del self.by_id[peer.system]
        return moved

    def _make_room(self, now: float) -> bool:
        """Drop the least important peer, so that many names cannot shut out an operator."""
        spare = [p for p in self.by_id.values() if p.system not in self.kept and p.system not in self.called]
        if not spare:
            return False
        count = Counter(peer.source for peer in spare)

        def worth(peer: Peer) -> tuple[bool, bool, bool, float]:
            if not self.is_in_contact(peer, now):
                return False, False, False, peer.announced
            return True, count[peer.source] <= SHARE, peer.commands, peer.received_at

        least = min(spare, key=worth)
        if self.is_in_contact(least, now):
            self._gone.append(least)
        del self.by_id[least.system]
        return True


class DropCounts:
    """Counts of dropped datagrams, by reason and sender; senders beyond the first 64 of a reason share a name.

    `merge_inactive(now)`, called now and then, makes room: senders of which nothing was dropped for 300 s lose their
    names.
    """

    def __init__(self) -> None:
        self._counts: dict[str, Counter[str]] = {}
        self._active: set[tuple[str, str]] = set()
        self._forgot = -math.inf

    def add(self, reason: str, sender: str) -> bool:
        """Count one; whether it is the first of this sender for this reason, so that it is worth a warning."""
        senders = self._counts.setdefault(reason, Counter())
        sender = sender if sender in senders or len(senders) < MOST_NAMED else OTHERS
        senders[sender] += 1
        self._active.add((reason, sender))
        return senders[sender] == 1

    def merge_inactive(self, now: float) -> None:
        """Make room for new names."""
        if now - self._forgot < NAMED:
            return
        for reason, senders in self._counts.items():
            for sender in [each for each in senders if each != OTHERS and (reason, each) not in self._active]:
                senders[OTHERS] += senders.pop(sender)
        self._active.clear()
        self._forgot = now

    def __getitem__(self, reason: str) -> Counter[str]:
        """The counts of each sender for a reason."""
        return self._counts.get(reason, Counter())

    def __str__(self) -> str:
        """The sums by reason, and who sent most: "12 not announced (0x4001 at 10.0.0.7: 12)"; empty if none."""
        each: list[str] = []
        for reason, senders in self._counts.items():
            name, most = senders.most_common(1)[0]
            worst = f"{name}: {most}" if len(senders) > 1 else name
            each.append(f"{senders.total()} {reason} ({worst})")
        return ", ".join(each)


def _is_host(address: str) -> bool:
    """Whether an address is the IPv4 address of a computer."""
    try:
        parsed = IPv4Address(address)
    except ValueError:
        return False
    return not (parsed.is_unspecified or parsed.is_multicast or parsed.is_reserved)
