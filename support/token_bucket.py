"""A limit to how often something may happen, of one or of many."""

import math
from collections.abc import Hashable


class TokenBucket:
    """Lets through `rate` per second, and after a pause `burst` at the same time; at first, too.

    `left` was left at the time `now` (s). A caller that judges many at the same time may take from it itself.
    """

    __slots__ = ("burst", "left", "now", "rate")

    def __init__(self, rate: float, burst: float):
        self.rate: float = rate
        self.burst: float = burst
        self.left: float = burst
        self.now: float = -math.inf

    def refill(self, now: float) -> float:
        """Amount that may pass at the time `now` (s)."""
        if now != self.now:
            self.left = min(self.burst, self.left + max(0.0, now - self.now) * self.rate)
            self.now = now
        return self.left

    def try_acquire(self, now: float, cost: float = 1.0) -> bool:
        """Whether one more, or what costs as much as `cost`, may pass at the time `now` (s)."""
        if self.refill(now) < cost:
            return False
        self.left -= cost
        return True

    def spend(self, now: float, cost: float) -> float:
        """Take what has passed already; the time (s) until something more may pass."""
        self.left = self.refill(now) - cost
        return max(0.0, -self.left / self.rate)


class TokenBuckets:
    """A bucket for each of `most` keys; one more takes the place of the one that was used longest ago."""

    def __init__(self, rate: float, burst: float, most: int):
        self._rate, self._burst, self._most = rate, burst, most
        self._buckets: dict[Hashable, TokenBucket] = {}

    def __len__(self) -> int:
        return len(self._buckets)

    def __getitem__(self, key: Hashable) -> TokenBucket:
        found = self._buckets.pop(key, None)
        if found is None:
            if len(self._buckets) >= self._most:
                del self._buckets[next(iter(self._buckets))]
            found = TokenBucket(self._rate, self._burst)
        self._buckets[key] = found  # at the end: the first is the one that was used longest ago
        return found
