"""Whether the position of a receiver moves as the speed that it reports itself, which it measures by Doppler shift."""

import math

import imc
from autonomy.navigation.fault_detection import CumulativeSum
from support.wgs84 import offset

VELOCITY = imc.GpsFix.Validity.VALID_SOG | imc.GpsFix.Validity.VALID_COG
ALLOWED = 0.15  # m/s, of speed over ground
WANDERING = 15.0  # m, of the position of a sound receiver, and
ACCURACIES = 3.0  # times its horizontal accuracy
LONGEST = 5.0  # s between two fixes that are compared


class FixDriftDetector:
    """Sums up how far fixes move away from their own speed over ground, north and east, beyond an allowance."""

    def __init__(self) -> None:
        self._north, self._east = CumulativeSum(), CumulativeSum()
        self.reset()

    def resume(self) -> None:
        """Compare the next fix with none before: the process has stood still."""
        self._last: tuple[float, imc.GpsFix] | None = None

    def reset(self) -> None:
        """Forget the fixes before: the position has jumped."""
        self.resume()
        self._north.reset()
        self._east.reset()

    def update(self, now: float, fix: imc.GpsFix) -> bool:
        """Take a fix at a time (s); whether the position drifts. Fixes without speed and course are not judged."""
        if fix.validity & VELOCITY != VELOCITY or not math.isfinite(fix.sog + fix.cog):
            return False
        before, self._last = self._last, (now, fix)
        if before is None or not 0.0 < now - before[0] <= LONGEST:
            return False
        dt, old = now - before[0], before[1]
        north, east = offset(old.lat, old.lon, fix.lat, fix.lon)
        along = 0.5 * (old.sog * math.cos(old.cog) + fix.sog * math.cos(fix.cog))
        across = 0.5 * (old.sog * math.sin(old.cog) + fix.sog * math.sin(fix.cog))
        self._north.add(north - dt * along, dt * ALLOWED)
        self._east.add(east - dt * across, dt * ALLOWED)
        accuracy = fix.hacc if fix.validity & imc.GpsFix.Validity.VALID_HACC else 0.0
        return max(self._north.value, self._east.value) > max(WANDERING, ACCURACIES * accuracy)
