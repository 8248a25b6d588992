"""A queue of events, ordered by time, then by arrival."""

from collections import deque
from collections.abc import Callable, Iterable
from heapq import heapify, heappop, heappush
from typing import Any

from runtime.kernel.clock import SECOND
from runtime.kernel.stalls import StallRecord
from runtime.kernel.timer import Timer, owner_of

FEW_TIMERS = 1000  # fewer timers than this are not searched for canceled ones


class EventQueue:
    """Calls that are due, and timers.

    `soon` appends a call to those that are due now; `at` schedules it for a time (integer nanoseconds since 1970).
    Calls that are due at the same time run in the order in which they were requested. `stalls` has the times in which
    calls were due and none was made.
    """

    def __init__(self, now_ns: int, *, virtual: bool) -> None:
        self.virtual = virtual
        self.set_now(now_ns)
        self.stalls: StallRecord = StallRecord()
        self._due: deque[tuple[Callable[..., object], tuple[Any, ...]]] = deque()
        # Takes (function, args): `soon` without a call, for the bus.
        self.enqueue: Callable[[tuple[Callable[..., object], tuple[Any, ...]]], None] = self._due.append
        self._later: list[tuple[int, int, Timer]] = []
        self._sweep_at = FEW_TIMERS
        self._arrivals = 0
        self._put_off: list[tuple[int, Callable[[], object]]] = []

    def set_now(self, time_ns: int) -> None:
        """Set the present time; `now` is the same in seconds."""
        self.now_ns: int = time_ns
        self.now: float = time_ns / SECOND

    @property
    def is_idle(self) -> bool:
        """Whether nothing else is due now."""
        return not self._due

    def timers(self) -> list[Timer]:
        """All pending timers, in the order in which they will be called."""
        due = [args[0] for _, args in self._due if args and isinstance(args[0], Timer)]
        later = [timer for _, _, timer in sorted(self._later, key=lambda e: e[:2])]
        return [timer for timer in (*due, *later) if timer.function is not None]

    def replace_timers(self, timers: Iterable[Timer]) -> None:
        """Replace all pending calls by these timers; those of the same time run in this order."""
        self.clear()
        for timer in timers:
            self._arrivals += 1
            heappush(self._later, (timer.time, self._arrivals, timer))

    def pop_due(self, owner: object) -> Timer | None:
        """Take the next timer of `owner` out of the queue of what is due now."""
        for entry in self._due:
            if self._owner(*entry) is owner and entry[1] and isinstance(timer := entry[1][0], Timer) and timer.function:
                self._due.remove(entry)
                return timer
        return None

    @property
    def has_unqueued_timers(self) -> bool:
        """Whether timers that are due now wait behind calls that came between two runs."""
        return bool(self._later) and self._later[0][0] <= self.now_ns

    def queue_due_timers(self) -> None:
        """Move the timers that are due now to the queue, as the kernel does when time has passed."""
        self._gather()

    def clear(self) -> None:
        """Drop all pending calls."""
        self._due.clear()
        self._later.clear()
        self._put_off.clear()

    def soon(self, function: Callable[..., object], *args: Any) -> None:
        self._due.append((function, args))

    def at(self, time_ns: int, function: Callable[..., object], *args: Any) -> Timer:
        timer = Timer(time_ns, function, args)
        self.schedule_timer(timer, time_ns)
        return timer

    def schedule_timer(self, timer: Timer, time_ns: int) -> None:
        """Schedule a timer that is not pending, such as one whose call is being made."""
        now, later = self.now_ns, self._later
        self._arrivals = arrival = self._arrivals + 1
        if time_ns <= now:
            timer.time = now
            if time_ns == now or self.virtual:
                self._due.append((self._fire, (timer,)))
                return
            time_ns = now  # it is overdue, and waits for the next turn
        timer.time = time_ns
        heappush(later, (time_ns, arrival, timer))
        if len(later) > self._sweep_at:
            self._sweep()

    def after(self, seconds: float, function: Callable[..., object], *args: Any) -> Timer:
        time_ns = self.now_ns + round(seconds * SECOND)
        timer = Timer(time_ns, function, args)
        timer.stalled = self.stalls.total
        self.schedule_timer(timer, time_ns)
        return timer

    def after_or_idle(self, seconds: float, function: Callable[[], object]) -> None:
        """Call `function` after so many seconds, or as soon as there is nothing else to do. Not on a virtual clock."""
        self._put_off.append((self.now_ns + round(seconds * SECOND), function))

    def _gather(self) -> None:
        """Move the timers that are due to the queue."""
        later, put_off, now, enqueue, fire = self._later, self._put_off, self.now_ns, self.enqueue, self._fire
        if put_off:
            self._due.extend((function, ()) for time_ns, function in put_off if time_ns <= now)
            put_off[:] = [entry for entry in put_off if entry[0] > now]
        while later and later[0][0] <= now:
            enqueue((fire, (heappop(later)[2],)))

    def _sweep(self) -> None:
        """Drop canceled timers, so that watchdogs that are restarted all the time do not pile up."""
        self._later[:] = [entry for entry in self._later if entry[2].function is not None]
        heapify(self._later)
        self._sweep_at = max(FEW_TIMERS, 2 * len(self._later))

    def _fire(self, timer: Timer) -> None:
        timer.queued = False
        if timer.function is not None:
            timer.function(*timer.args)

    def _owner(self, function: Callable[..., object], args: tuple[Any, ...]) -> object:
        return args[0].owner if args and isinstance(args[0], Timer) else owner_of(function)
