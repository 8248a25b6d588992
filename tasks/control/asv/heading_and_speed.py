"""Controls heading and speed of a boat with two motors side by side."""

import math
from typing import ClassVar

import imc
from autonomy.control import allocate_thrust, forces_to_actuations
from runtime import param
from tasks.control.asv.boat_control import SPEED, YAW, YAW_RATE, HeadingTask, SpeedTask

PORT, STARBOARD = 0, 1


class HeadingAndSpeed(HeadingTask, SpeedTask):
    """Turns DesiredHeading, DesiredHeadingRate and DesiredSpeed into thrust at port and starboard.

    Runs while one of the loops YAW, YAW_RATE and SPEED is enabled. The steering effort is a fraction of the full force,
    subtracted on one side and added on the other, so it turns the boat equally at any speed.
    """

    controlled: ClassVar[int] = YAW | YAW_RATE | SPEED

    highest_difference: float = param(
        0.4,
        "1",
        "Largest fraction of the full force used for turning, on each side.",
        name="Maximum Thrust Differential Actuation",
        minimum=0,
        maximum=1,
    )
    heading_error: float = param(
        60.0,
        "°",
        "Above this heading error the boat first turns on the spot.",
        name="Maximum Heading Error to Thrust",
        minimum=0,
        maximum=180,
    )
    share_saturation: bool = param(True, "", "Turning has priority over speed when a motor is at its limit.")
    reverse: float = param(
        1.0,
        "1",
        "Force astern as a fraction of the force ahead.",
        name="Reverse Thrust Factor",
        minimum=0.05,
        maximum=1,
    )

    def actuate(self, state: imc.EstimatedState, mask: int, dt: float) -> bool:
        turning = bool(mask & YAW) and not mask & YAW_RATE
        off = turning and abs(self.heading_controller.error(state.psi)) > math.radians(self.heading_error)
        share = self.thrust_fraction(state, mask, dt, held=off)
        effort = self.steering_effort(state, mask, dt, self.highest_difference)
        ahead = share * abs(share) if share is not None and not off else 0.0
        limits = self.highest_thrust**2, self.reverse * self.highest_thrust**2
        forces = allocate_thrust(ahead, effort or 0.0, *limits, turn_first=self.share_saturation)
        self._thrust(*forces_to_actuations(forces, self.reverse))
        return share is not None and effort is not None

    def center_actuators(self) -> None:
        self._thrust(0.0, 0.0)

    def _thrust(self, port: float, starboard: float) -> None:
        self.publish(imc.SetThrusterActuation(id=PORT, value=port))
        self.publish(imc.SetThrusterActuation(id=STARBOARD, value=starboard))
