"""Decides whether an underwater vehicle is at sea and not on a bench, where its motor must not turn by itself."""

import math

from autonomy.control.measured_depth import DepthCondition

DEEPEST_BENCH = 5.0  # m that a depth sensor may show on a bench
BEYOND = 10.0  # m below its limit that a vehicle may be; a sensor without its cable shows more
SUNK, AGREEMENT = 1.0, 0.3  # m deeper and as much nearer to the bottom, and by how much the two may differ


class ImmersionDetector:
    """`is_at_sea` is False on a bench; it stays True, and may be set by who knows it.

    A depth of more than 5 m, and at most 10 m beyond the limit `deepest` (m) of the vehicle, for 1 s shows it, and so
    does an altitude that has decreased by as much as the depth has increased, by 1 m: in air a Doppler log or an echo
    sounder measures no distance that follows the depth.
    """

    def __init__(self, deepest: float = math.inf) -> None:
        self.is_at_sea: bool = False
        self._deepest = deepest + BEYOND
        self._measured, self._estimated, self._sunk = DepthCondition(), DepthCondition(), DepthCondition()
        self._shallowest, self._water = math.inf, math.nan

    def record_depth(self, now: float, depth: float) -> None:
        """Take a measured depth (m) at the time `now` (s)."""
        self.is_at_sea |= self._measured.update(now, DEEPEST_BENCH < depth <= self._deepest)

    def record_estimate(self, now: float, depth: float, altitude: float) -> None:
        """Take an estimated depth and altitude above the bottom (m; below zero if unknown) at the time `now` (s)."""
        self.is_at_sea |= self._estimated.update(now, DEEPEST_BENCH < depth <= self._deepest)
        water = depth + altitude if altitude >= 0.0 else math.nan
        if not (depth >= self._shallowest and abs(water - self._water) <= AGREEMENT):
            self._shallowest, self._water = depth, water
        self.is_at_sea |= self._sunk.update(now, depth - self._shallowest > SUNK)
