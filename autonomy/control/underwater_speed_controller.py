"""Turns the desired speed of an underwater vehicle into the rotation rate and the actuation of its thruster."""

from dataclasses import dataclass

from autonomy.control.pid import PID, PIDGains

STANDSTILL = 0.1  # m/s; a lower speed counts as 0


@dataclass(frozen=True)
class ThrusterGains:
    """Gains and limits of ThrusterController."""

    speed: PIDGains  # rpm per m/s
    speed_feedforward: float  # rpm per m/s
    rate: PIDGains  # actuation per rpm
    rate_feedforward: float  # actuation per rpm
    acceleration: float  # rpm/s, fastest change of the rotation rate
    lowest: float  # rpm while moving
    highest: float  # rpm
    full: float  # rpm at full actuation
    regulates_itself: bool = True  # the motor controller regulates the rotation rate


class ThrusterController:
    """Feed-forward plus a PID of the speed, whose integral keeps running while the rotation rate ramps.

    D acts on the measured speed only, so a new reference causes no jump. `rpm` is the last commanded rotation rate,
    `u` (m/s) and `measured` (rpm) are the speed and rotation rate of the last steps.
    """

    def __init__(self, gains: ThrusterGains):
        self.set_gains(gains)
        self.reset()

    def set_gains(self, gains: ThrusterGains) -> None:
        """Use other gains; the integrals start over."""
        self.gains = gains
        self.speed: PID = PID.from_gains(gains.speed)
        self._rate = PID.from_gains(gains.rate)

    def reset(self) -> None:
        """Start from standstill."""
        self.rpm: float = 0.0
        self.u: float = 0.0
        self.measured: float = 0.0
        self.reset_integrals()

    def reset_integrals(self) -> None:
        """Forget the errors, as for a reference in another unit."""
        self.speed.reset()
        self._rate.reset()

    def halt(self) -> None:
        """Command a rotation rate of 0."""
        self.speed.reset()
        self.rpm = 0.0

    def step_speed_loop(self, u: float, desired: float, dt: float) -> float:
        """The rotation rate (rpm) at a surge of `u` for a desired one (m/s); with a `dt` of 0 it stays as it is.

        `dt` is the time since the last step (s).
        """
        slower, self.u = self.u - u, u
        if dt <= 0.0:
            return self.rpm
        if desired < STANDSTILL:
            self.halt()
            return self.rpm
        gains = self.gains
        correction = self.speed.step(dt, desired - u, slower / dt)
        wanted = correction + gains.speed_feedforward * desired
        change = gains.acceleration * dt
        ramped = max(self.rpm - change, min(self.rpm + change, wanted))
        self.rpm = max(gains.lowest, min(gains.highest, ramped))
        return self.rpm

    def actuation(self, measured: float, wanted: float | None, dt: float) -> float:
        """The actuation at a measured rotation rate for a desired one (rpm); 0 if none is desired.

        `dt` is the time since the last measurement (s), 0 if that was too long ago.
        """
        slower, self.measured = self.measured - measured, measured
        if wanted is None:
            return 0.0
        if self.gains.regulates_itself:
            return wanted / self.gains.full
        rate = slower / dt if dt > 0.0 else 0.0
        correction = self._rate.step(dt, wanted - measured, rate) if wanted else 0.0
        return correction + self.gains.rate_feedforward * wanted
