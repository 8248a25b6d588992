"""Lines of one kind in the log book, of which others may cause any number."""

from collections.abc import Callable

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
