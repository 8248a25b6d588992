"""Follows the bottom below an underwater vehicle."""

import math
from collections import deque
from collections.abc import Sequence
from operator import mul


class BottomEstimator:
    """The depth of the bottom (m) below the vehicle and its rate (m/s), smoothed by a finite impulse response filter.

    While the altitude is unknown, `is_known` is false and the last depth counts; it is infinite before the first one.
    """

    def __init__(self, weights: Sequence[float]):
        total = math.fsum(weights)
        self._weights = [weight / total for weight in weights] if total else []
        self._past: deque[float] = deque(maxlen=len(self._weights) or 1)
        self._altitude = -1.0
        self._measured = math.inf
        self.is_known: bool = False
        self.depth: float = math.inf
        self.rate: float = 0.0

    def update(self, altitude: float, depth: float, dt: float) -> None:
        """Take altitude (m, negative if unknown) and depth (m) of the vehicle, `dt` (s) after those before.

        An altitude that has not changed is an old one, not one of a bottom that sinks with the vehicle.
        """
        if not 0.0 <= altitude < math.inf:
            self._altitude, self.is_known, self.rate = -1.0, False, 0.0
            return
        if altitude != self._altitude:
            self._altitude, self._measured = altitude, depth + altitude
        if not self.is_known:
            self._past.clear()
        past, before = self._past, self.depth
        past.append(self._measured)
        while len(past) < len(self._weights):
            past.append(self._measured)
        self.depth = math.fsum(map(mul, self._weights, past)) if self._weights else self._measured
        self.rate = (self.depth - before) / dt if self.is_known and dt > 0.0 else 0.0
        self.is_known = True
