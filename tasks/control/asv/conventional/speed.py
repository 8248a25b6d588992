"""Controls the speed of a boat with one motor."""

from typing import ClassVar

import imc
from tasks.control.asv.boat_control import SPEED, SpeedTask


class Speed(SpeedTask):
    """Turns DesiredSpeed into thrust of motor 0, while the loop SPEED is enabled."""

    controlled: ClassVar[int] = SPEED

    def actuate(self, state: imc.EstimatedState, mask: int, dt: float) -> bool:
        share = self.thrust_fraction(state, mask, dt)
        self._thrust(share or 0.0)
        return share is not None

    def center_actuators(self) -> None:
        self._thrust(0.0)

    def _thrust(self, value: float) -> None:
        self.publish(imc.SetThrusterActuation(id=0, value=value))
