"""Goes from one depth to another above a point."""

import math
from typing import ClassVar

import imc
from runtime import param
from tasks.maneuver.depth_spiral import spiral
from tasks.maneuver.maneuver_task import Maneuver, PathEnd, PathFlags


class Elevator(Maneuver):
    """Goes to a point, or stays where it is, and spirals from one depth or altitude to another."""

    subscribed: ClassVar[tuple[type[imc.Message], ...]] = (imc.PathControlState, imc.EstimatedState, imc.DesiredZ)

    minimum_radius: float = param(10.0, "m", "Smallest radius; smaller ones are raised to it.", minimum=0)
    vertical_monitor: bool = param(True, "", "Fail if the depth does not change.", name="VMonitor")
    slowest: float = param(0.1, "m/s", "Smallest vertical speed; below 0 for none.", name="VMonitor -- Minimum Speed")
    patience: float = param(
        20.0, "s", "Time over which the vertical speed is measured.", name="VMonitor -- Timeout", minimum=0.1
    )

    async def execute(self, elevator: imc.Elevator) -> None:
        e, here = elevator, elevator.flags & imc.Elevator.Flags.CURR_POS
        leg = PathEnd(e.lat, e.lon, e.end_z, e.end_z_units, e.speed, e.speed_units)
        if not here:
            await self.go_to_end(leg._replace(z=e.start_z, z_units=e.start_z_units), after=math.inf)
        await spiral(
            self,
            leg,
            max(e.radius, self.minimum_radius),
            flags=PathFlags.LOITER_CURR if here else 0,
            slowest=self.slowest,
            patience=self.patience if self.vertical_monitor else math.inf,
            required=True,
        )
