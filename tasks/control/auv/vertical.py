"""Turns an altitude reference into a depth reference."""

import math
from collections import deque
from collections.abc import Sequence
from operator import mul

Limits = tuple[float, float]


class AltitudeReference:
    """Turns a desired altitude into a depth, smoothed by a finite impulse response filter with `weights`.

    While the altitude is unknown the vehicle holds its depth; `lost` is how long (s) it has been unknown.
    """

    def __init__(self, weights: Sequence[float]):
        total = math.fsum(weights)
        self._weights = [weight / total for weight in weights] if total else []
        self._past: deque[float] = deque(maxlen=len(self._weights) or 1)
        self._depth: float | None = None
        self._kept: float | None = None
        self.lost = 0.0

    def depth(self, altitude: float, depth: float, above: float, dt: float) -> tuple[float, float]:
        """Depth (m, at least 0) at `above` (m) over the bottom, and its rate (m/s)."""
        if altitude < 0.0:
            self.lost += dt
            self._kept = depth if self._kept is None else self._kept
            self._past.clear()
            self._depth = None
            return self._kept, 0.0
        self.lost, self._kept = 0.0, None
        target = max(0.0, depth + altitude - above)
        if self._weights:
            while len(self._past) < len(self._weights):
                self._past.append(target)
            self._past.append(target)
            target = math.fsum(map(mul, self._weights, self._past))
        rate = (target - self._depth) / dt if self._depth is not None and dt > 0.0 else 0.0
        self._depth = target
        return target, rate
