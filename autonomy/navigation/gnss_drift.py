"""Whether the position of a receiver moves as the speed that it reports itself, which it measures by Doppler shift."""

import imc
from autonomy.navigation.fault_detection import CumulativeSum
from autonomy.navigation.gnss_velocity_check import reported_velocity
from support.wgs84 import offset

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
        self._last: tuple[float, imc.GpsFix, tuple[float, float]] | None = None

    def reset(self) -> None:
        """Forget the fixes before: the position has jumped."""
        self.resume()
        self._north.reset()
        self._east.reset()

    def update(self, now: float, fix: imc.GpsFix) -> bool:
        """Take a fix at a time (s); whether the position drifts. Fixes without speed and course are not judged."""
        velocity = reported_velocity(fix)
        if velocity is None:
            return False
        before, self._last = self._last, (now, fix, velocity)
        if before is None or not 0.0 < now - before[0] <= LONGEST:
            return False
        dt, old, last = now - before[0], before[1], before[2]
        north, east = offset(old.lat, old.lon, fix.lat, fix.lon)
        self._north.add(north - dt * 0.5 * (last[0] + velocity[0]), dt * ALLOWED)
        self._east.add(east - dt * 0.5 * (last[1] + velocity[1]), dt * ALLOWED)
        accuracy = fix.hacc if fix.validity & imc.GpsFix.Validity.VALID_HACC else 0.0
        return max(self._north.value, self._east.value) > max(WANDERING, ACCURACIES * accuracy)
