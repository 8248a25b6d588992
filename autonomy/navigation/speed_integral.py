"""The way between two measurements of something else, by a speed that is measured at times of its own."""

import math
from typing import NamedTuple

HELD = 1.0  # s; a speed counts for as long, before and after its measurement


class Sample(NamedTuple):
    """A speed (m/s) at a time (s), and the way up to then (m)."""

    time: float
    speed: float
    way: float


class SpeedIntegral:
    """Integrates a speed by the trapezoidal rule over the times at which it was measured, not at which it is used.

    A computer that is late uses it much later than it was measured, and one sample stands for a long time. From the
    newest measurement on, the speed is held; the next one corrects this, so that errors do not add up.
    """

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """The speed is unknown until the next measurement."""
        self._before: Sample | None = None
        self._newest: Sample | None = None
        self._taken = math.nan

    @property
    def speed(self) -> float:
        """The newest speed (m/s), nan if it is unknown."""
        return self._newest.speed if self._newest is not None else math.nan

    def add(self, time: float, speed: float) -> None:
        """Add a speed (m/s) measured at a time (s); the last one of those with the same time counts."""
        newest, before = self._newest, self._before
        if newest is None or not abs(time - newest.time) <= HELD:
            self.forget()
            self._newest = Sample(time, speed, 0.0)
        elif time > newest.time:
            way = newest.way + 0.5 * (time - newest.time) * (newest.speed + speed)
            self._before, self._newest = newest, Sample(time, speed, way)
        elif time == newest.time:
            way = before.way + 0.5 * (time - before.time) * (before.speed + speed) if before is not None else newest.way
            self._newest = Sample(time, speed, way)

    def take(self, time: float) -> float:
        """The way (m) from the time of the last call to `time` (s), nan if the speed was unknown then or between."""
        before, self._taken = self._taken, self._way(time)
        return self._taken - before

    def skip(self) -> None:
        """Take the next way from the next call on."""
        self._taken = math.nan

    def _way(self, time: float) -> float:
        newest, before = self._newest, self._before
        if newest is None or abs(time - newest.time) > HELD:
            return math.nan
        if time >= newest.time or before is None:
            return newest.way + (time - newest.time) * newest.speed
        elapsed = time - before.time
        bend = (newest.speed - before.speed) / (newest.time - before.time)
        return before.way + elapsed * (before.speed + 0.5 * bend * elapsed)
