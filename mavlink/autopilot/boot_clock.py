"""The clock of an autopilot, which counts from its start."""

import math

SLOWEST_ROUND = 0.5  # s; a slower answer is no measure of the clock
LARGEST_AGE = 1.0  # s; older stamps are wrong
BACKWARDS = 1.0  # s by which the count may go back; more is a new start
BEHIND = 10.0  # s by which it may be behind the time that has passed, on a slow link; more is one, too
FORGETS = 1e-4  # s/s; how fast a short delay is forgotten, since clocks drift


class BootClock:
    """Converts times since the start of an autopilot to s since 1970 UTC.

    Until the autopilot answers TIMESYNC, the fastest message gives the difference of the clocks.
    """

    def __init__(self) -> None:
        self._reset()

    def _reset(self) -> None:
        self._last = -math.inf
        self._fastest, self._fastest_at = math.inf, 0.0
        self._offset: float | None = None
        self._round = math.inf

    def update(self, count: float, now: float) -> bool:
        """Take a count (s) that has arrived `now`; True if the autopilot has started anew."""
        anew = count < self._last - BACKWARDS or now - count > self._fastest + BEHIND
        if anew:
            self._reset()
        self._last = max(self._last, count)
        fastest = self._fastest + FORGETS * (now - self._fastest_at)
        self._fastest, self._fastest_at = min(fastest, now - count), now
        return anew

    def apply_timesync(self, asked: float, count: float, now: float) -> None:
        """Take an answer to TIMESYNC: asked at one time (s), answered at the remote count (s), arrived `now`."""
        took = now - asked
        if not 0.0 <= took <= SLOWEST_ROUND or took > 2.0 * self._round + 0.01:
            return
        self._round = min(took, 1.1 * self._round)
        self._offset = 0.5 * (asked + now) - count

    def time(self, count: float, now: float) -> float:
        """The time of a count; `now` if that cannot be true."""
        offset = self._fastest if self._offset is None else self._offset
        time = min(offset + count, now)
        return time if now - time <= LARGEST_AGE else now
