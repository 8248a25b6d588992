"""Controls the heading of a boat with a rudder."""

import math

import imc
from runtime import param
from tasks.control.asv.pilot import Loops, Steered


class Heading(Steered):
    """Turns DesiredHeading and DesiredHeadingRate into the position of the rudder, servo 0.

    While the loops YAW and YAW_RATE are enabled. The effort is the angle of the rudder at the reference speed; it grows
    with the square of that speed over the boat's. A positive angle turns to port, as on the fins of a LAUV.
    """

    controlled = Loops.YAW | Loops.YAW_RATE

    maximum_angle: float = param(
        25.0, "°", "Largest angle of the rudder.", name="Maximum Rudder Angle", minimum=0, maximum=90
    )
    reference_speed: float = param(1.5, "m/s", "Speed that the gains are for.", minimum=0.1)
    slowest: float = param(0.75, "m/s", "Speed below which the gains grow no more.", name="Minimum Speed", minimum=0.1)

    def act(self, state: imc.EstimatedState, mask: int, dt: float) -> bool:
        growth = (self.reference_speed / max(self.slowest, state.u)) ** 2
        limit = math.radians(self.maximum_angle)
        effort = self.steer(state, mask, dt, limit / growth)
        self._turn(-growth * (effort or 0.0))
        return effort is not None

    def rest(self) -> None:
        self._turn(0.0)

    def _turn(self, angle: float) -> None:
        self.publish(imc.SetServoPosition(id=0, value=angle))
