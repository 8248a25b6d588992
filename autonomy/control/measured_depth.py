"""Judges the samples of a depth sensor: how fast the vehicle rises, and whether it is too deep."""

import math

from support.number_parsing import clamp_magnitude

LASTING = 1.0  # s of samples without a gap; a single one may be wrong
DEPTH_JUMP = 1.0  # m beyond what motion explains
SMOOTHING, FASTEST = 0.05, 3.0  # weight of a new rate of depth; m/s that it can be
COASTS, GENTLY = 4.0, 0.4  # s, m/s: without its motor, a vehicle that sinks faster coasts for the time at the excess


class DepthCondition:
    """Whether all samples have met a condition for `LASTING`."""

    def __init__(self) -> None:
        self._since = math.inf

    def update(self, now: float, is_met: bool) -> bool:
        """Take a sample at the time `now` (s)."""
        self._since = min(self._since, now) if is_met else math.inf
        return now - self._since >= LASTING


class MeasuredDepth:
    """The depth (m) by a sensor and its time (s), the speed upward (m/s), and the sum of its jumps (m)."""

    def __init__(self) -> None:
        self.depth: float = -math.inf
        self.time: float = -math.inf
        self.rising: float = 0.0
        self.jumped: float = 0.0
        self.is_too_deep: bool = False
        self._deep = DepthCondition()

    @property
    def jumped_up(self) -> float:
        """The sudden decrease of depth (m)."""
        return -self.jumped if self.jumped < -DEPTH_JUMP else 0.0

    def update(self, now: float, depth: float, deepest: float) -> None:
        """Take a sample (m); it is too deep below `deepest`, or if its rate leads there."""
        if now > self.time > -math.inf:
            rate = (self.depth - depth) / (now - self.time)
            if abs(self.depth - depth) > DEPTH_JUMP + FASTEST * (now - self.time):
                self.jumped += depth - self.depth
            self.rising += SMOOTHING * (clamp_magnitude(rate, FASTEST) - self.rising)
        self.depth, self.time = depth, now
        coasts = COASTS * max(0.0, -self.rising - GENTLY)
        self.is_too_deep = self._deep.update(now, depth + coasts > deepest)
