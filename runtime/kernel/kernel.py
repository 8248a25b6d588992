"""Runs one queue of events on a clock."""

import time
from collections import deque
from collections.abc import Callable
from heapq import heappop
from typing import Any

from runtime.kernel.clock import SECOND, Clock
from runtime.kernel.errors import LivelockError, raise_error, to_ordinary_exception, warn_slow
from runtime.kernel.event_queue import EventQueue
from runtime.kernel.observer import KernelObserver
from runtime.kernel.selector import WatchedSources
from runtime.kernel.stalls import PUNCTUAL, postpone_timeouts
from runtime.kernel.timer import Readable, Timer, handler_name

LIVELOCK_EVENTS = 100_000
LIVELOCK_PATIENCE = 5 * SECOND  # on a wall clock, a queue that has not been empty for this long may be a livelock
POLL_EVENTS = 64  # on a virtual clock, sockets are polled after this many events
POLL_PERIOD = SECOND // 1000  # on a wall clock, sockets are polled this often even if the queue never empties
DEEPEST_CHAIN = 64  # calls, each caused by the one before, that are made before timers and sockets have their turn
LONGEST_MOMENT = SECOND // 5  # of real time; a clock that waits for an empty queue passes on then, as in a flood
LONG_CALL = SECOND // 1000  # ns, after which the processor time of a call is measured


class Kernel(EventQueue):
    """Runs all handlers on one thread, one at a time, each to its end.

    `post` is the only thread-safe method.

    `on_error(owner, exception)` is called when a call raises: it either handles the exception or raises, which ends the
    run. On a wall clock, `on_slow(owner, seconds, handler)` reports a call that used the processor for longer than
    `slow` seconds, and `stalls` has the times in which calls were due and none was made.
    `observers` observe all calls on a virtual clock.
    It is a livelock if a virtual clock stands still for `livelock_events` calls; on a wall clock, if the queue does not
    empty within that many calls although timers and sockets are held back.
    """

    def __init__(self, clock: Clock, *, slow: float = 0.1):
        self.clock = clock
        super().__init__(clock.read(), virtual=clock.virtual)
        self.slow_ns: int = int(slow * SECOND)
        self.events: int = 0
        self.livelock_events = LIVELOCK_EVENTS
        self.on_error: Callable[[object, Exception], None] = raise_error
        self.on_slow: Callable[[object, float, str], None] = warn_slow
        self.observers: list[KernelObserver] = []
        self._posted: deque[tuple[Callable[..., object], tuple[Any, ...]]] = deque()
        self._stopping = False
        self._sources = WatchedSources()
        self._poll_next = 0
        self._busy = 0
        self._idle_at = self.now_ns
        self._emptied = time.monotonic_ns()
        self._stalled = False  # in this turn
        self._gathered = self.now_ns  # since when the calls in the queue are due, at the latest

    def post(self, function: Callable[..., object], *args: Any) -> None:
        """Request a call from any thread."""
        self._posted.append((function, args))
        self._sources.wake()

    def cancel_owner(self, owner: object) -> None:
        """Drop all calls to methods of `owner`, its timers, and the sockets that it watches."""
        for _, _, timer in self._later:
            if timer.owner is owner:
                timer.cancel()
        self._admit()
        kept = [(f, a) for f, a in self._due if self._owner(f, a) is not owner]
        self._due.clear()
        self._due.extend(kept)
        self._sources.unwatch_owner(owner)

    def watch(self, source: Readable, function: Callable[[], object]) -> Timer:
        """Call `function` whenever `source` has something to read. Raises KeyError if it is watched already."""
        return self._sources.watch(source, function)

    def unwatch(self, source: Readable | int) -> None:
        """Stop watching a source and drop a call that is pending for it; does nothing if it is not watched."""
        self._sources.unwatch(source)

    def stop(self) -> None:
        """End the run after the present call."""
        self._stopping = True

    def close(self) -> None:
        self._sources.close()

    def run(self, until: int | None = None) -> None:
        """Run until `stop()`, or until the clock reads `until` (ns); a virtual clock then stops exactly there.

        A virtual run also ends when nothing is left to do. Raises what `on_error` raises, and LivelockError.
        """
        self._stopping = False
        self._emptied = time.monotonic_ns()
        self.set_now(max(self.now_ns, self.clock.read()))
        self._gathered = self.now_ns
        while not self._stopping:
            if self._posted:
                self._admit()
            if self.virtual:
                self._run_moment()
            else:
                self._make_calls(len(self._due), DEEPEST_CHAIN)
                if self._busy > self.livelock_events and self.now_ns - self._idle_at > LIVELOCK_PATIENCE:
                    self._look_for_livelock()
            if self._stopping or not self._advance(until):
                break

    def drain(self) -> None:
        """Run what is due now, and all that this causes, without waiting."""
        self._stopping = False
        for _ in range(self.livelock_events):
            if not self._due:
                break
            function, args = self._due.popleft()
            try:
                function(*args)
            except BaseException as error:
                self.on_error(self._owner(function, args), to_ordinary_exception(error))

    def _run_moment(self) -> None:
        due, instruments, on_error, most = self._due, self.observers, self.on_error, self.livelock_events
        before = busy = self._busy
        try:
            while due and not self._stopping:
                function, args = due.popleft()
                if instruments:
                    for instrument in instruments:
                        instrument.before_call(function, args)
                busy += 1  # the watchdog reads it
                try:
                    function(*args)
                except BaseException as error:
                    on_error(self._owner(function, args), to_ordinary_exception(error))
                if busy > most:
                    raise LivelockError(most, self._owner(function, args))
        finally:
            self._busy = busy
            self.events += busy - before

    def _make_calls(self, most: int, chain: int = 1) -> object:
        """Make the next calls, so many at most, and report those that were slow; the owner of the last one.

        Those that they cause follow, down to `chain` calls that cause each other, before timers and sockets: else a
        kernel that is behind would serve each link of a chain from sensor to motor only once per turn, and all that it
        controls would be as many turns old.
        """
        due, read, slow, busy = self._due, self.clock.read, self.slow_ns, 0
        call = None
        began = marked = time.perf_counter_ns()
        used = time.thread_time_ns()
        try:
            while due and not self._stopping:
                if busy == most:
                    chain -= 1
                    if not chain:
                        break
                    most += len(due)
                function, args = call = due.popleft()
                busy += 1
                try:
                    function(*args)
                except BaseException as error:
                    self.on_error(self._owner(function, args), to_ordinary_exception(error))
                ended = time.perf_counter_ns()
                if ended - began > LONG_CALL:
                    # Others used at most what passed before this call, so this one did not wait for the processor.
                    if (own := time.thread_time_ns() - used - (began - marked)) > slow:
                        self.on_slow(self._owner(function, args), own / SECOND, handler_name(function, args))
                    ended, used = time.perf_counter_ns(), time.thread_time_ns()
                    marked = ended
                began, now = ended, read()
                if now > self.now_ns:
                    self.set_now(now)
                    if now - self._gathered > PUNCTUAL:
                        self._stalled |= self.stalls.note_delay(self._gathered, now) > 0
        finally:
            self.events += busy
            self._busy += busy
        return call and self._owner(*call)

    def _look_for_livelock(self) -> None:
        """Distinguish a livelock from a busy machine.

        A queue that stays full for seconds may be either. Timers and sockets are held back for a while: on a busy
        machine the queue then empties, because only they filled it; in a livelock the calls cause each other.
        """
        before, owner = self.events, self._make_calls(self.livelock_events)
        self._busy, self._idle_at = 0, self.now_ns
        if self.events - before == self.livelock_events:
            self.on_error(owner, LivelockError(self.livelock_events, owner))

    def _advance(self, until: int | None) -> bool:
        """Let time pass until something is due, and queue it; False at the end of the run."""
        later = self._later
        while later and later[0][2].function is None:
            heappop(later)
        return self._advance_virtual(until) if self.virtual else self._advance_wall(until)

    def _advance_virtual(self, until: int | None) -> bool:
        if self._sources.count and self.events >= self._poll_next:
            self._poll_next = self.events + POLL_EVENTS
            self._poll(0)
        if self._posted or self._due:
            return True
        now, target, is_last = self.now_ns, self._later[0][0] if self._later else None, False
        if until is not None and (target is None or target >= until):
            target, is_last = max(until, now), True
        reached = self.clock.advance(target, self._poll)
        if reached is None:
            return False
        if reached > now:
            self.set_now(reached)
            self._busy = 0
        elif reached != target:
            self._count_standstill()
        if reached != target:
            self._poll(0)
        elif is_last:
            return False
        self._gather()
        return True

    def _count_standstill(self) -> None:
        """A clock that stops short of the next event again and again hangs the run as a livelock does."""
        self._busy += 1
        if self._busy > self.livelock_events:
            raise LivelockError(self.livelock_events, self.clock)

    def _advance_wall(self, until: int | None) -> bool:
        clock, now = self.clock, self.now_ns
        if until is not None and now >= until:
            return False
        wake = self._later[0][0] if self._later else None
        if until is not None:
            wake = until if wake is None else min(wake, until)
        due = self._gathered if self._due else wake
        if self._due:
            self._look()
            if self._later and time.monotonic_ns() - self._emptied > LONGEST_MOMENT:
                clock.advance(wake, lambda _: None)
            reached = clock.read()
        else:
            self._busy, self._idle_at = 0, now
            reached = clock.advance(wake, self._wait)
            if reached is None:
                return False
            self._emptied = time.monotonic_ns()
            self._poll_next = self._emptied + POLL_PERIOD
        if reached > now:
            self.set_now(reached)
        if due is not None and reached - due > PUNCTUAL:
            self._stalled |= self.stalls.note_delay(due, self.now_ns) > 0
        if self._stalled:
            self._stalled = False
            postpone_timeouts(self._later, self.stalls.total, self.now_ns)
        self._gathered = self.now_ns
        self._gather()
        return True

    def _wait(self, timeout: float) -> None:
        """Poll the sockets; rather than wait, make the calls that were put off."""
        if timeout > 0.0 and self._put_off:
            self._due.extend((function, ()) for _, function in self._put_off)
            self._put_off.clear()
            timeout = 0.0
        self._poll(timeout)

    def _look(self) -> None:
        """Poll the sockets without waiting, since other calls are due."""
        now = time.monotonic_ns()
        if now >= self._poll_next:
            self._poll_next = now + POLL_PERIOD
            self._poll(0)

    def _poll(self, timeout: float) -> None:
        self._due.extend((self._fire, (timer,)) for timer in self._sources.wait(timeout))

    def _admit(self) -> None:
        for _ in range(len(self._posted)):
            self._due.append(self._posted.popleft())
