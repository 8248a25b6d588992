"""Compares how the position of a GPS receiver moves with the velocity that it measures by Doppler shift."""

import math

import imc
from autonomy.navigation.fault_detection import Disagreement

MEMORY = 60.0  # s
LARGEST, SIGMAS = 6.0, 9.0  # m, standard deviations of fixes: how far position and velocity may have moved apart
RELIEF = 0.5  # the share of it at which a fault is over
STEP = 5.0  # m; a position that jumps farther between two fixes is not one that drifts
LONGEST = 2.0  # s between two fixes
FASTEST = 100.0  # m/s
BOTH = int(imc.GpsFix.Validity.VALID_SOG | imc.GpsFix.Validity.VALID_COG)


def reported_velocity(fix: imc.GpsFix) -> tuple[float, float] | None:
    """Velocity north and east (m/s) of a fix, also a small one; None if it has none."""
    if fix.validity & BOTH != BOTH or not math.isfinite(fix.sog + fix.cog):
        return None
    return fix.sog * math.cos(fix.cog), fix.sog * math.sin(fix.cog)


def ground_velocity(fix: imc.GpsFix) -> tuple[float, float] | None:
    """Velocity north and east (m/s) of a fix; None if it has none that is possible."""
    return reported_velocity(fix) if 0.0 <= fix.sog <= FASTEST else None


class GnssVelocityCheck:
    """A receiver whose position moves against its own velocity is `faulty`; `reckoned` (m) then uses velocity."""

    def __init__(self) -> None:
        self.faulty: bool = False
        self.reckoned: tuple[float, float] = 0.0, 0.0
        self._north, self._east = Disagreement(MEMORY), Disagreement(MEMORY)
        self._last: tuple[float, float, float, float, float] | None = None

    def resume(self) -> None:
        """Compare the next fix with none before: the process has stood still."""
        self._last = None

    def update(
        self, time: float, north: float, east: float, sigma: float, velocity: tuple[float, float] | None
    ) -> None:
        """A fix at a time (s) and a place (m) of a standard deviation (m), and its velocity (m/s), None if unknown."""
        last, self._last = self._last, None if velocity is None else (time, north, east, *velocity)
        if last is None or velocity is None or not 0.0 < time - last[0] <= LONGEST:
            return
        dt = time - last[0]
        moved = 0.5 * dt * (last[3] + velocity[0]), 0.5 * dt * (last[4] + velocity[1])
        off = north - last[1] - moved[0], east - last[2] - moved[1]
        if math.hypot(*off) <= max(STEP, SIGMAS * sigma):
            self._north.add(dt, off[0])
            self._east.add(dt, off[1])
        if self.faulty:
            self.reckoned = self.reckoned[0] + moved[0], self.reckoned[1] + moved[1]
        else:
            self.reckoned = north, east
        apart = math.hypot(self._north.value, self._east.value)
        self.faulty = apart > max(LARGEST, SIGMAS * sigma) * (RELIEF if self.faulty else 1.0)
