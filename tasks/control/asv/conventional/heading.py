"""Controls the heading of a boat with a rudder."""

import math
from typing import ClassVar

import imc
from runtime import consume, param
from tasks.control.asv.boat_control import YAW, YAW_RATE, HeadingTask


class Heading(HeadingTask):
    """Turns DesiredHeading and DesiredHeadingRate into the rudder angle, servo 0.

    Runs while the loop YAW or YAW_RATE is enabled. The gains hold at the reference speed; at other speeds the angle is
    scaled by (reference speed / speed) squared. A positive angle turns to port, as on the fins of a LAUV.
    """

    controlled: ClassVar[int] = YAW | YAW_RATE

    maximum_angle: float = param(
        25.0, "°", "Largest angle of the rudder.", name="Maximum Rudder Angle", minimum=0, maximum=90
    )
    reference_speed: float = param(1.5, "m/s", "Speed at which the gains hold.", minimum=0.1)
    slowest: float = param(0.75, "m/s", "Below this speed the gains stop growing.", name="Minimum Speed", minimum=0.1)

    @consume
    def record_servo_report_time(self, position: imc.ServoPosition) -> None:
        self._reports[position.src_ent] = self.now

    def actuate(self, state: imc.EstimatedState, mask: int, dt: float) -> bool:
        growth = (self.reference_speed / max(self.slowest, state.u)) ** 2
        limit = math.radians(self.maximum_angle)
        effort = self.steering_effort(state, mask, dt, limit / growth)
        self._turn(-growth * (effort or 0.0))
        return effort is not None

    def center_actuators(self) -> None:
        self._turn(0.0)

    def _turn(self, angle: float) -> None:
        self.publish(imc.SetServoPosition(id=0, value=angle))
