"""Pauses between attempts of what fails again and again."""

import math


class Backoff:
    """The pause after each failure (s): `first`, then twice as long as before, at most `longest`.

    After `reset`, and after a failure that comes more than `healthy_after` s after the end of the pause before it, the
    first pause follows again. `failures` counts those since then.
    """

    def __init__(self, first: float, longest: float, healthy_after: float = math.inf):
        self.failures: int = 0
        self._first, self._longest, self._healthy_after = first, longest, healthy_after
        self._resumed = -math.inf

    def reset(self) -> None:
        """Note that it works."""
        self.failures = 0

    def fail(self, now: float = 0.0) -> float:
        """Count a failure at the time `now` (s); the pause before the next attempt."""
        if now - self._resumed > self._healthy_after:
            self.failures = 0
        pause = min(self._longest, self._first * 2.0 ** min(self.failures, 30))
        self.failures += 1
        self._resumed = now + pause
        return pause
