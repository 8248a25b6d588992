"""Lines of one kind in the log book, which strangers on the network cause."""

from collections.abc import Callable

from support.token_bucket import TokenBucket

AT_ONCE = 60
RATE = 0.5  # per second in the long run


class LogLimit:
    """Gives lines of one kind to `log`; of many that come at once the first ones, and that there are `more`."""

    def __init__(self, log: Callable[[str], object], more: str, now: float):
        self._log, self._more = log, more
        self._bucket = TokenBucket(RATE, AT_ONCE, now)
        self._is_open = True

    def write(self, text: str, now: float) -> None:
        """Log a line at the time `now` (s)."""
        is_open = self._bucket.try_acquire(now)
        if is_open or self._is_open:
            self._log(text if is_open else f"{self._more}, which are not logged one by one")
        self._is_open = is_open
