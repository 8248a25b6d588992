"""The packets of a log in their order, each at the nanosecond at which it was published."""

import math
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from typing import NamedTuple

import imc
from runtime.kernel import SECOND, nanoseconds
from shoal.rerun.run import LoggedRun

GRAINS = tuple(10**power for power in range(9, 0, -1))
REMEMBERED = 32
LATEST = 1e10  # s since 1970
MOST_WAITING = 1000


class LoggedPacket(NamedTuple):
    """A packet, when it was published (ns since 1970 UTC), and whether a task that runs again should publish it."""

    time: int
    header: imc.Header
    packet: bytes
    own: bool


class Instants:
    """Nanoseconds of times that packets carry as doubles, which cannot tell 200 of them apart.

    Of those that a double can mean, it is the one at which a task ticks, of rates (Hz) counted from `start` (ns);
    else the roundest, or the one with the roundest delay after one of the last instants. On a wall clock (`virtual` is
    False) instants are not round: it is the nearest.
    """

    def __init__(self, start: int, rates: Iterable[float] = (), *, virtual: bool = True):
        self._start = start
        self._virtual = virtual
        self._rates = sorted({rate for rate in rates if rate > 0.0})
        self._last = (math.nan, 0)
        self._recent: deque[int] = deque(maxlen=REMEMBERED)

    def of(self, time: float) -> int:
        """The instant of a finite time (s since 1970 UTC)."""
        if time != self._last[0]:
            self._last = time, self._find(time)
            self._recent.appendleft(self._last[1])
        return self._last[1]

    def is_tick(self, instant: int, rates: Iterable[float]) -> bool:
        """Whether one of these rates (Hz) ticks then."""
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
            for since in (0, *self._recent):
                instant = since + (near - since + grain // 2) // grain * grain
                if instant / SECOND == time:
                    return instant
        return near


class History:
    """A log as the tasks that run again meet it: `own` says which packets are theirs.

    Time is that of the owner's packets and never goes back: a measurement that is older than what was said before it
    was published at that moment. One of a message that is known to be `late` (id and entity) between two moments is of
    the second if its task, which ticks at `rates` (Hz, by entity), ticks only then.
    """

    def __init__(
        self,
        log: imc.Log | LoggedRun,
        owner: int,
        instants: Instants,
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

    def next(self) -> LoggedPacket | None:
        """The entry that is the turn of; None at the end."""
        if not self._ahead and (entry := self._read()) is not None:
            self._ahead.append(entry)
        return self._ahead[0] if self._ahead else None

    def take(self) -> LoggedPacket:
        """The next entry, which is then over."""
        return self._ahead.popleft()

    def until(self, kind: tuple[int, int], now: int) -> list[LoggedPacket]:
        """The entries up to the first own one of a message id and entity, and that one; empty where `now` has none."""
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
                    instant = self._instants.of(header.timestamp)
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
        """Give their moments to packets of which the last one's is `following`.

        Others were heard when they say, if that is between what the owner said before and after.
        """
        for header, packet in waiting:
            if header.src != self._owner:
                said = self._instants.of(header.timestamp) if 0.0 <= header.timestamp < LATEST else 0
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


def spoken_by(owner: int, entities: Collection[int]) -> Callable[[imc.Header], bool]:
    """Whether a packet is of one of these entities of the owner."""
    return lambda header: header.src == owner and header.src_ent in entities
