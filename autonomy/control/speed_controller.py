"""Turns a desired speed into the actuation of a boat's motor."""

import math
from collections.abc import Sequence

import imc
from autonomy.control.pid import PID

Units = imc.SpeedUnits
STANDSTILL = 0.1  # m/s; a lower speed counts as 0


class SpeedController:
    """Turns a DesiredSpeed into a fraction of full actuation, -1 to 1.

    A speed in m/s becomes a rotation rate: `feedforward` (rpm per m/s) plus a PID of the error (rpm). The rate starts
    at that of the current speed, changes by at most `acceleration` (rpm/s) and stays within `limits` (lowest and
    highest, rpm). The integral is frozen while the rate is at a limit or still ramping. D acts on the measured speed
    only, so a new reference causes no jump. `full` is the rate at full actuation (rpm).
    """

    def __init__(
        self,
        gains: Sequence[float],
        integral_limit: float,
        feedforward: float,
        limits: tuple[float, float],
        acceleration: float,
        full: float,
    ):
        self._law = PID(gains, integral_limit=integral_limit)
        self._feedforward = feedforward
        self._lowest, self._highest = limits
        self._acceleration = acceleration
        self._full = full
        self.reset()

    def reset(self) -> None:
        """Forget the reference and start from standstill."""
        self.desired: imc.DesiredSpeed | None = None
        self._rpm: float | None = None
        self._u: float | None = None
        self._law.reset()

    def set_desired(self, speed: imc.DesiredSpeed) -> bool:
        """Set the desired speed; False if it is invalid."""
        if not math.isfinite(speed.value) or speed.speed_units not in tuple(Units):
            return False
        if self.desired is None or self.desired.speed_units != speed.speed_units:
            self._law.reset()
        self.desired = speed
        return True

    def actuation(self, u: float, dt: float, *, held: bool = False) -> float:
        """Fraction of full actuation at a surge of `u` (m/s), `dt` s after the last; `held` freezes the integral."""
        desired, before = self.desired, self._u
        self._u = u
        if desired is None:
            return 0.0
        if desired.speed_units == Units.PERCENTAGE:
            return max(-1.0, min(1.0, 0.01 * desired.value))
        if desired.speed_units == Units.RPM:
            return max(-1.0, min(1.0, desired.value / self._full))
        if desired.value < STANDSTILL:
            self._law.reset()
            self._rpm = 0.0
            return 0.0
        error, change = desired.value - u, self._acceleration * dt
        error_rate = (before - u) / dt if before is not None and dt > 0.0 else 0.0
        rpm = self._feedforward * max(0.0, u) if self._rpm is None else self._rpm
        wanted = self._law.step(0.0, error, error_rate) + self._feedforward * desired.value
        reached = max(self._lowest, min(self._highest, max(rpm - change, min(rpm + change, wanted))))
        if not held and (reached == wanted or (wanted - reached) * error < 0.0):
            self._law.step(dt, error, error_rate)
        self._rpm = reached
        return max(-1.0, min(1.0, reached / self._full))

    @property
    def pid_parts(self) -> imc.ControlParcel:
        """P, I, D parts of the last rotation rate (rpm)."""
        law = self._law
        return imc.ControlParcel(p=law.p, i=law.i, d=law.d, a=law.p + law.i + law.d)
