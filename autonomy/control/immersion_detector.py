"""Decides whether an underwater vehicle is at sea and not on a bench, where its motor must not turn by itself."""

import math

from autonomy.control.measured_depth import DepthCondition

DEEPEST_BENCH = 5.0  # m that a depth sensor may show on a bench
BEYOND = 10.0  # m below its limit that a vehicle may be; a sensor without its cable shows more
SUNK, AGREEMENT = 1.0, 0.3  # m deeper and as much nearer to the bottom, and by how much the two may differ
LONGEST_STEP, FASTEST = 1.0, 3.0  # s and m/s, of a vertical speed that counts


class _Descent:
    """A way down by which the altitude has decreased."""

    def __init__(self) -> None:
        self._lasting = DepthCondition()
        self._highest, self._water = math.inf, math.nan

    def update(self, now: float, way: float, altitude: float) -> bool:
        """Take a way downward and an altitude (m; below zero if unknown) at `now` (s); whether both changed by 1 m."""
        water = way + altitude if altitude >= 0.0 else math.nan
        if not (way >= self._highest and abs(water - self._water) <= AGREEMENT):
            self._highest, self._water = way, water
        return self._lasting.update(now, way - self._highest > SUNK)


class ImmersionDetector:
    """Detects a vehicle at sea: `is_at_sea` is False on a bench, stays True, and may be set by others.

    A depth of more than 5 m, and at most 10 m beyond the limit `deepest` (m) of the vehicle, for 1 s shows it. So does
    an altitude that has decreased by as much as the depth has increased, by 1 m, or by as much as the vehicle has sunk
    by its vertical speed, if the depth is wrong: in air a Doppler log or an echo sounder measures no distance that
    follows either.
    """

    def __init__(self, deepest: float = math.inf) -> None:
        self.is_at_sea: bool = False
        self._deepest = deepest + BEYOND
        self._measured, self._estimated = DepthCondition(), DepthCondition()
        self._by_depth, self._by_speed = _Descent(), _Descent()
        self._way, self._last = 0.0, (-math.inf, math.nan)

    def record_depth(self, now: float, depth: float) -> None:
        """Take a measured depth (m) at the time `now` (s)."""
        if not self.is_at_sea:
            self.is_at_sea = self._measured.update(now, DEEPEST_BENCH < depth <= self._deepest)

    def record_estimate(self, now: float, depth: float, altitude: float, sinking: float) -> None:
        """Take an estimate at the time `now` (s).

        It has depth and altitude above the bottom (m; below zero if unknown), and the speed downward (m/s; nan if
        unknown).
        """
        if self.is_at_sea:
            return
        self.is_at_sea |= self._estimated.update(now, DEEPEST_BENCH < depth <= self._deepest)
        self.is_at_sea |= self._by_depth.update(now, depth, altitude)
        (before, speed), self._last = self._last, (now, sinking)
        if 0.0 <= now - before <= LONGEST_STEP and abs(speed) <= FASTEST and abs(sinking) <= FASTEST:
            self._way += 0.5 * (now - before) * (speed + sinking)
            self.is_at_sea |= self._by_speed.update(now, self._way, altitude)
        else:
            self._by_speed = _Descent()
