"""Checks that reject bad fixes and velocities."""

import math
from collections import deque
from dataclasses import dataclass

import imc
from support.wgs84 import is_on_earth

Reason = imc.GpsFixRejection.Reason
DvlReason = imc.DvlRejection.Reason
VALID_POS, VALID_HACC = imc.GpsFix.Validity.VALID_POS.value, imc.GpsFix.Validity.VALID_HACC.value
FEWEST = 3  # least number of fixes for a moving average
LARGEST_RATE = 20.0  # rad/s
HIGHEST, DEEPEST = -11.0, 12000.0  # m; a depth sensor in a vacuum shows -10, and no sea is deeper
GPS_JUMP = 50.0  # m that end a plan
FAULT_HOLD = 10.0  # s, how long an error is shown at least


def has_plausible_position(fix: imc.GpsFix) -> bool:
    """Whether latitude, longitude and height can be those of a vehicle; receivers without a fix report 0, 0."""
    return is_on_earth(fix.lat, fix.lon) and math.isfinite(fix.height) and not fix.lat == fix.lon == 0.0


def assume_height(fix: imc.GpsFix, height: float) -> imc.GpsFix:
    """The fix at `height` (m above the ellipsoid) if it has none, for those who need only latitude and longitude."""
    return fix.replace(height=height) if math.isnan(fix.height) else fix


@dataclass
class FixGate:
    """Rejects fixes without a valid position, and those whose claimed accuracy is too bad or much worse than before.

    A receiver that counts its satellites has no fix from none.
    """

    factor: float
    samples: int
    maximum_hacc: float
    maximum_hdop: float

    def __post_init__(self) -> None:
        self._accuracies: deque[float] = deque(maxlen=max(1, self.samples))
        self._counts_satellites = False

    def reject_reason(self, fix: imc.GpsFix) -> Reason | None:
        """Reason why a fix is rejected; None if it is accepted."""
        numbers = fix.lat, fix.lon, fix.height, fix.hacc, fix.hdop
        if not fix.validity & VALID_POS or not all(map(math.isfinite, numbers)):
            return Reason.LOST_VAL_BIT
        if abs(fix.lat) > 0.5 * math.pi or abs(fix.lon) > math.pi:
            return Reason.INVALID
        if self._counts_satellites and not fix.satellites:
            return Reason.INVALID
        self._counts_satellites |= fix.satellites > 0
        if fix.validity & VALID_HACC:
            past = self._accuracies
            mean = math.fsum(past) / len(past) if len(past) >= FEWEST else math.inf
            past.append(fix.hacc)
            if fix.hacc > self.factor * mean:
                return Reason.ABOVE_THRESHOLD
            return Reason.ABOVE_MAX_HACC if fix.hacc > self.maximum_hacc else None
        return Reason.ABOVE_MAX_HDOP if fix.hdop > self.maximum_hdop else None


@dataclass
class VelocityGate:
    """Rejects velocities that jump within a `window` (s) or are too large, along and across (m/s)."""

    jump: tuple[float, float]
    largest: tuple[float, float]
    window: float

    def __post_init__(self) -> None:
        self._last = (-math.inf, 0.0, 0.0)

    def reject_reason(self, time: float, x: float, y: float) -> tuple[DvlReason, float] | None:
        """Reason why a velocity (m/s) is rejected, and the number that is too large; None if it is accepted."""
        then, before_x, before_y = self._last
        if time - then <= self.window:
            for reason, change, limit in (
                (DvlReason.INNOV_THRESHOLD_X, abs(x - before_x), self.jump[0]),
                (DvlReason.INNOV_THRESHOLD_Y, abs(y - before_y), self.jump[1]),
            ):
                if change > limit:
                    return reason, change
        for reason, size, limit in (
            (DvlReason.ABS_THRESHOLD_X, abs(x), self.largest[0]),
            (DvlReason.ABS_THRESHOLD_Y, abs(y), self.largest[1]),
        ):
            if size > limit:
                return reason, size
        self._last = time, x, y
        return None
