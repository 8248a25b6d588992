"""Depth and altitude references: what depth they ask for now."""

import math
from collections import deque
from collections.abc import Sequence
from operator import mul

Limits = tuple[float, float]


class AltitudeReference:
    """Turns an altitude to keep into a depth to go to, smoothed by the finite impulse response `weights`.

    Where the altitude is unknown, the depth is kept for as long; `lost` is the time (s) since when it is.
    """

    def __init__(self, weights: Sequence[float]):
        total = math.fsum(weights)
        self._weights = [weight / total for weight in weights] if total else []
        self._past: deque[float] = deque(maxlen=len(self._weights) or 1)
        self._depth: float | None = None
        self._kept: float | None = None
        self.lost = 0.0

    def depth(self, altitude: float, depth: float, above: float, dt: float) -> tuple[float, float]:
        """The depth (m) that is `above` (m) the bottom, never less than 0, and its rate (m/s)."""
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
            target = sum(map(mul, self._weights, self._past))
        rate = (target - self._depth) / dt if self._depth is not None and dt > 0.0 else 0.0
        self._depth = target
        return target, rate
