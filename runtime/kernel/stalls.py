"""The times in which a kernel on a wall clock did not run although calls were due, and what they mean for timers."""

from collections import deque
from heapq import heapify
from itertools import takewhile
from typing import NamedTuple

from runtime.kernel.clock import SECOND
from runtime.kernel.timer import Timer

PUNCTUAL = SECOND // 10  # ns; a call that is due may always be this late
LISTENING = SECOND  # ns; after a stall, what is waited for has this much time to arrive
MOST_STALLS = 1000  # that are remembered


class Stall(NamedTuple):
    """A time in which the process did not run; in ns since 1970."""

    begin: int
    end: int


class StallRecord:
    """Remembers when the kernel was late: the computer was busy, the process was halted, or a handler took long.

    Of each delay the first `PUNCTUAL` ns do not count as a stall. So time passes for what is really silent also while
    the computer is too slow at every moment, though more slowly.
    """

    def __init__(self) -> None:
        self.total = 0  # ns
        self._stalls: deque[Stall] = deque(maxlen=MOST_STALLS)

    def note_delay(self, due: int, now: int) -> int:
        """A call that was due at `due` is made `now` (ns since 1970); returns by how much the stall has grown (ns)."""
        begin = max(due + PUNCTUAL, self._stalls[-1].end if self._stalls else 0)
        if begin >= now:
            return 0
        self._stalls.append(Stall(begin, now))
        self.total += now - begin
        return now - begin

    def recent(self, now: int) -> int:
        """How long the last stall was (ns), if it ended less than `LISTENING` before `now`; else 0."""
        last = self._stalls[-1] if self._stalls else Stall(0, -LISTENING)
        return last.end - last.begin if now - last.end < LISTENING else 0

    def longest_since(self, since: int) -> int:
        """The longest stall that ended after `since` (ns since 1970), in ns; 0 if there was none."""
        recent = takewhile(lambda stall: stall.end > since, reversed(self._stalls))
        return max((stall.end - stall.begin for stall in recent), default=0)

    def between(self, since: float, now: int) -> int:
        """How long the process did not run between two times (ns since 1970)."""
        if not self._stalls or since >= self._stalls[-1].end:
            return 0
        recent = takewhile(lambda stall: stall.end > since, reversed(self._stalls))
        return sum(min(stall.end, now) - int(max(stall.begin, since)) for stall in recent if stall.begin < now)


def postpone_timeouts(later: list[tuple[int, int, Timer]], stall: int, now: int) -> None:
    """Give the timers that wait for a span of time, and ran out in a stall (ns), the time in which nothing was heard.

    They are due after the rest of their span, at most `LISTENING` from `now`: what they wait for may have arrived long
    ago, and is only read now. Timers that are due at a time of day stay as they are.
    """
    for index, (time, arrival, timer) in enumerate(later):
        if timer.is_timeout and time < now + LISTENING:
            timer.time = min(time + stall, now + LISTENING)
            later[index] = timer.time, arrival, timer
    heapify(later)
