"""The times in which a kernel on a wall clock did not run although calls were due, and what they mean for timers."""

from heapq import heapify
from typing import NamedTuple

from runtime.kernel.clock import SECOND
from runtime.kernel.timer import Timer

PUNCTUAL = SECOND // 10  # ns; a call that is due may always be this late
LISTENING = SECOND  # ns; after a stall, what is waited for has this much time to arrive
LATEST = 5  # stalls that never count; what has been silent for longer has had its turn in each of them
COUNTED = SECOND // 2  # ns of each further stall in succession that count for a clock without stalls


class Stall(NamedTuple):
    """A time in which the process did not run; in ns since 1970."""

    begin: int
    end: int

    @property
    def length(self) -> int:
        return self.end - self.begin


class StallRecord:
    """Remembers when the kernel was late: the computer was busy, the process was halted, or a handler took long.

    A kernel that is behind works in turns: all that is due, and all that this causes, before it looks at the time
    again. Of each turn the first `PUNCTUAL` ns are no stall, the rest is one. A stall is left out of ages until the
    process has run for as long as it lasted, and is no longer among the `LATEST`: then all that had to arrive has had
    the time to. So what is really silent is found also while the computer is too slow at every moment, and a timeout
    of half an hour runs out in half an hour.

    `left_out` is what a clock without stalls leaves out of the `total`: all of a stall, unless it is one of more than
    `LATEST` in succession, none of which ended `LISTENING` before the next began. Of these the first `COUNTED` ns
    count, so that on such a computer a timeout runs out in its time, or in two turns per second of it.
    """

    def __init__(self) -> None:
        self.total: int = 0  # ns
        self.left_out: int = 0  # ns
        self._stalls: list[Stall] = []
        self._succession = 0

    def note_delay(self, due: int, now: int) -> int:
        """A call that was due at `due` is made `now` (ns since 1970); returns by how much the stall has grown (ns)."""
        last = self._stalls[-1].end if self._stalls else 0
        begin = max(due + PUNCTUAL, last)
        if begin >= now:
            return 0
        before = self._left_out_of_latest if begin == last else 0
        if begin == last:
            self._stalls[-1] = Stall(self._stalls[-1].begin, now)
        else:
            self._succession = self._succession + 1 if begin - last < LISTENING else 1
            older = [stall for stall in self._stalls[:-LATEST] if now - stall.end < stall.length]
            self._stalls = [*older, *self._stalls[-LATEST:], Stall(begin, now)]
        self.total += now - begin
        self.left_out += self._left_out_of_latest - before
        return now - begin

    @property
    def _left_out_of_latest(self) -> int:
        """Part of the latest stall that a clock without stalls leaves out (ns)."""
        return max(0, self._stalls[-1].length - (COUNTED if self._succession > LATEST else 0))

    def recent(self, now: int) -> int:
        """The longest stall (ns) of those that ended less than `LISTENING` before `now`; 0 if there was none."""
        return self.longest_since(now - LISTENING)

    def longest_since(self, since: int, begun: int = 0) -> int:
        """The longest stall (ns) that ended after `since` and began at `begun` or later (ns since 1970); 0 if none."""
        return max((stall.length for stall in self._stalls if stall.end > since and stall.begin >= begun), default=0)

    def left_out_since(self, since: float) -> int:
        """The time that the process did not run since a time (ns since 1970), as far as ages leave it out (ns)."""
        if not self._stalls or since >= self._stalls[-1].end:
            return 0
        return sum(stall.end - int(max(stall.begin, since)) for stall in self._stalls if stall.end > since)


def postpone_timeouts(later: list[tuple[int, int, Timer]], total: int, now: int) -> None:
    """Give the timers that wait for a span of time, and ran out in a stall, the time in which nothing was received.

    `total` is that of all stalls (ns). They are due after the rest of their span, at most `LISTENING` from `now`: what
    they wait for may have arrived long ago, and is only read now. Timers that are due at a time of day stay as they
    are.
    """
    for index, (time, arrival, timer) in enumerate(later):
        if timer.stalled is not None:
            stall, timer.stalled = total - timer.stalled, total
            if time < now + LISTENING:
                timer.time = min(time + stall, now + LISTENING)
                later[index] = timer.time, arrival, timer
    heapify(later)
