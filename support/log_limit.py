"""Limits what is logged: of events that others may cause in any number, and of faults that last."""

import math
from collections.abc import Callable, Hashable

from support.token_bucket import TokenBucket

AT_ONCE = 60
RATE = 0.5  # per second in the long run


class LogLimit:
    """Passes on lines of one kind; of many that come at once the first ones, and that there are `more`."""

    def __init__(self, more: str):
        self._more = more
        self._bucket = TokenBucket(RATE, AT_ONCE)
        self._is_open = True

    def write(self, log: Callable[[str], object], text: str, now: float) -> None:
        """Give a line to `log`, a method of a log book, at the time `now` (s)."""
        is_open = self._bucket.try_acquire(now)
        if is_open or self._is_open:
            log(text if is_open else f"{self._more}, which are not logged one by one")
        self._is_open = is_open


class Trouble:
    """The reason why something does not work, empty while it works; a new one is logged, the same one is not again."""

    def __init__(self) -> None:
        self.reason: str = ""

    def report(self, reason: str, log: Callable[[str], object], text: str = "") -> None:
        """Set the reason; if it is new, `log`, a method of a log book, is called with `text`, by default the reason."""
        before, self.reason = self.reason, reason
        if reason != before:
            log(text or reason)

    def end(self) -> str:
        """Note that it works; returns the reason why it did not until now, if any."""
        before, self.reason = self.reason, ""
        return before


class ReportLimit:
    """Lets one report on each subject through in a `period`, in the unit of `now`; without a period, one for good.

    Reports on more than `most` subjects in this time are left out.
    """

    def __init__(self, period: float = math.inf, most: int = 64):
        self._period = period
        self._most = most
        self._last: dict[Hashable, float] = {}

    @property
    def is_full(self) -> bool:
        """Whether reports on further subjects are left out."""
        return len(self._last) >= self._most

    def is_due(self, subject: Hashable = "", now: float = 0.0) -> bool:
        """Whether to report on a subject at the time `now`; if so, the caller does."""
        if now - self._last.get(subject, -math.inf) < self._period:
            return False
        if subject not in self._last and self.is_full:
            self._last = {each: last for each, last in self._last.items() if now - last < self._period}
            if self.is_full:
                return False
        self._last[subject] = now
        return True
