"""A limit to how often something may happen."""


class TokenBucket:
    """Lets through `rate` per second, and after a pause `burst` at the same time."""

    def __init__(self, rate: float, burst: float, now: float):
        self._rate = rate
        self._burst = burst
        self._left = burst
        self._then = now

    def try_acquire(self, now: float, cost: float = 1.0) -> bool:
        """Whether one more, or what costs as much as `cost`, may pass at the time `now` (s)."""
        self._left = min(self._burst, self._left + max(0.0, now - self._then) * self._rate)
        self._then = now
        if self._left < cost:
            return False
        self._left -= cost
        return True
