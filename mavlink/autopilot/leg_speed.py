"""Whether an autopilot keeps the speed of a leg: the command is accepted, and what it measures agrees."""

import math

from mavlink.autopilot.leg import Leg, ReportedPosition
from mavlink.autopilot.setpoints import CommandMessage, speed_command
from mavlink.autopilot.vehicle_modes import SteeredVehicle

TRIES, RETRY = 3, 1.5  # s between commands that were not accepted
SETTLING = 3.0  # s after the command in which it slows down
PERSISTENCE = 3.0  # s for which a speed has to be wrong
TOO_FAST, MARGIN = 1.25, 0.5  # times the speed of the leg, m/s
TOO_SLOW, SLOW_FOR = 0.5, 20.0  # times the speed of the leg, s
FAR = 5.0  # s from the end of a leg in which a vehicle slows down


class LegSpeed:
    """The dialogue about one speed (m/s): sent after the target, accepted, compared with the measured one.

    ArduCopter and Rover lose, or do not accept, a speed that comes before their first target. `error` is why the leg
    has to end; `warning` is reported once.
    """

    def __init__(self) -> None:
        self.restart(math.nan)

    def restart(self, speed: float) -> None:
        """Begin a new leg."""
        self.speed: float = speed
        self.error: str = ""
        self.warning: str = ""
        self._tries, self._due = 0, -math.inf
        self._accepted_at, self._wrong_since, self._slow_since = math.inf, math.inf, math.inf
        self._corrected = self._warned = False

    def command(self, vehicle: SteeredVehicle, leg: Leg, at: ReportedPosition, now: float) -> CommandMessage | None:
        """Compare with the measured speed; returns the command that has to be sent now, if one has to."""
        far = not leg.radius and leg.progress(at).left > FAR * leg.speed
        self.compare(at.airspeed if vehicle.roams else math.hypot(at.vx, at.vy), now, far=far)
        if self.error or not math.isinf(self._accepted_at) or now < self._due:
            return None
        self._tries += 1
        self._due = now + RETRY
        return speed_command(vehicle, leg.speed)

    def settle(self, reason: str, now: float) -> None:
        """The command was answered, or the leg's own gave the speed: "" if it was accepted, else why not."""
        if not reason:
            self._accepted_at = now
        elif self._tries >= TRIES:
            self.error = reason

    def compare(self, measured: float, now: float, *, far: bool) -> None:
        """Compare with a measured speed (m/s); not a number if there is none. far: it need not slow down yet."""
        if math.isnan(measured) or math.isnan(self.speed) or now - self._accepted_at < SETTLING:
            self._wrong_since = self._slow_since = math.inf
            return
        self._note_slow(measured, now, far=far)
        if measured <= TOO_FAST * self.speed + MARGIN:
            self._wrong_since = math.inf
            return
        self._wrong_since = min(self._wrong_since, now)
        if now - self._wrong_since < PERSISTENCE:
            return
        if self._corrected:
            self.error = f"it moves at {measured:.1f} m/s, not the plan's {self.speed:g} m/s"
            return
        self._corrected = True
        self._tries, self._due, self._accepted_at = 0, -math.inf, math.inf

    def _note_slow(self, measured: float, now: float, *, far: bool) -> None:
        slow = far and measured < TOO_SLOW * self.speed
        self._slow_since = min(self._slow_since, now) if slow else math.inf
        if now - self._slow_since >= SLOW_FOR and not self._warned:
            self._warned = True
            self.warning = f"it moves at {measured:.1f} m/s only, not the plan's {self.speed:g} m/s"
