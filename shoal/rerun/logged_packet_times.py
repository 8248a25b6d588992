"""The packets of a log in order, each with the nanosecond at which it was published."""

import math
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from itertools import islice
from typing import NamedTuple

import imc
from runtime.kernel import SECOND, nanoseconds
from shoal.rerun.run_log_sequence import LoggedRun

GRAINS = tuple(10**power for power in range(9, 0, -1))
NEAR, FAR = 32, 512  # instants that are remembered, for all delays and for those that are ROUND
ROUND = 10**7  # ns; with shorter grains, one of so many instants would often fit by chance
LATEST = 1e10  # s since 1970
MOST_WAITING = 1000


class LoggedPacket(NamedTuple):
    """A packet, when it was published (ns since 1970 UTC), and whether a re-run task should publish it."""

    time: int
    header: imc.Header
    packet: bytes
    own: bool


class TimestampResolver:
    """Finds the nanosecond of a packet's time, a double that stands for some 200 of them.

    It takes the one at which a task ticks, of `rates` (Hz) counted from `start` (ns); else the roundest, or the one
    with the roundest delay after a recent instant. On a wall clock (`virtual` is False) instants are not round: it
    takes the nearest.
    """

    def __init__(self, start: int, rates: Iterable[float] = (), *, virtual: bool = True):
        self._start = start
        self._virtual = virtual
        self._rates = sorted({rate for rate in rates if rate > 0.0})
        self._last = (math.nan, 0)
        self._recent: deque[int] = deque(maxlen=FAR)

    def resolve(self, time: float) -> int:
        """The instant (ns) of a finite time (s), both since 1970 UTC."""
        if time != self._last[0]:
            self._last = time, self._find(time)
            self._recent.appendleft(self._last[1])
        return self._last[1]

    def is_tick(self, instant: int, rates: Iterable[float]) -> bool:
        """Whether one of these rates (Hz) ticks at an instant (ns)."""
        counts = ((round((instant - self._start) * rate / SECOND), rate) for rate in rates if rate > 0.0)
        return any(self._start + round(count * SECOND / rate) == instant for count, rate in counts)

    def _find(self, time: float) -> int:
        near = nanoseconds(time)
        if not self._virtual:
            return near
        for rate in self._rates:
            count = round((near - self._start) * rate / SECOND)
            tick = self._start + round(count * SECOND / rate)
            if tick / SECOND == time:
                return tick
        for grain in GRAINS:
            for since in (0, *islice(self._recent, FAR if grain >= ROUND else NEAR)):
                instant = since + (near - since + grain // 2) // grain * grain
                if instant / SECOND == time:
                    return instant
        return near


class LogReplay:
    """A log as the re-run tasks receive it; `own` finds their packets, `start` is in ns.

    Time is that of the owner's packets and never goes back: a measurement with an earlier time than the packet before
    it was published at the time of that packet. A message that is known to be `late` (id and entity) and lies between
    two moments belongs to the second if its task, which ticks at `rates` (Hz, by entity), ticks only then.
    """

    def __init__(
        self,
        log: imc.Log | LoggedRun,
        owner: int,
        instants: TimestampResolver,
        own: Callable[[imc.Header], bool],
        start: int,
        late: Collection[tuple[int, int]] = (),
        rates: Mapping[int, Collection[float]] | None = None,
    ):
        self._packets = log.packets()
        self._owner = owner
        self._instants = instants
        self._own = own
        self._latest = start
        self._late = late
        self._rates = rates or {}
        self._ahead: deque[LoggedPacket] = deque()
        self._timed: deque[LoggedPacket] = deque()

    def peek(self) -> LoggedPacket | None:
        """The next packet, which is not removed; None at the end."""
        if not self._ahead and (entry := self._read()) is not None:
            self._ahead.append(entry)
        return self._ahead[0] if self._ahead else None

    def pop(self) -> LoggedPacket:
        """Remove and return the packet that `peek` found."""
        return self._ahead.popleft()

    def pop_until_own_packet(self, kind: tuple[int, int], now: int) -> list[LoggedPacket]:
        """Take out all up to the first own packet of `kind` (message id, entity), if it is due by `now` (ns)."""
        for index, entry in enumerate(self._until(now)):
            if entry.own and (entry.header.id, entry.header.src_ent) == kind:
                return [self._ahead.popleft() for _ in range(index + 1)]
        return []

    def _until(self, now: int) -> Iterator[LoggedPacket]:
        index = 0
        while index < len(self._ahead) or self._extend():
            if self._ahead[index].time > now:
                return
            yield self._ahead[index]
            index += 1

    def _extend(self) -> bool:
        entry = self._read()
        if entry is not None:
            self._ahead.append(entry)
        return entry is not None

    def _read(self) -> LoggedPacket | None:
        if not self._timed:
            waiting: list[tuple[imc.Header, bytes]] = []
            for _, packet in self._packets:
                header = imc.header(packet)
                waiting.append((header, packet))
                if header.src == self._owner and 0.0 <= header.timestamp < LATEST:
                    instant = self._instants.resolve(header.timestamp)
                    if instant > self._latest or not self._may_be_late(header):
                        self._date(waiting, max(self._latest, instant))
                        break
                if len(waiting) == MOST_WAITING:
                    break
            if waiting:
                self._date(waiting, self._latest)
        return self._timed.popleft() if self._timed else None

    def _may_be_late(self, header: imc.Header) -> bool:
        return (header.id, header.src_ent) in self._late and header.src_ent in self._rates

    def _date(self, waiting: list[tuple[imc.Header, bytes]], following: int) -> None:
        """Set the times of packets; that of the last one is `following` (ns).

        A packet of another system has its own time if that lies between those of the owner's packets around it.
        """
        for header, packet in waiting:
            if header.src != self._owner:
                said = self._instants.resolve(header.timestamp) if 0.0 <= header.timestamp < LATEST else 0
                if self._latest <= said <= following:
                    self._latest = said
            elif self._may_be_late(header):
                rates = self._rates[header.src_ent]
                if self._instants.is_tick(following, rates) and not self._instants.is_tick(self._latest, rates):
                    self._latest = following
            self._timed.append(LoggedPacket(self._latest, header, packet, self._own(header)))
        waiting.clear()
        last = self._timed.pop()
        self._latest = following
        self._timed.append(last._replace(time=following))


def make_sender_test(owner: int, entities: Collection[int], since: float = -math.inf) -> Callable[[imc.Header], bool]:
    """A function that returns whether a packet comes from one of these entities of the owner, not before a time (s)."""
    return lambda header: header.src == owner and header.src_ent in entities and not header.timestamp < since
