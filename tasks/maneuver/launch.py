"""Goes to a point once the vehicle is in the water."""

from typing import ClassVar

import imc
from tasks.maneuver.maneuver_task import Loops, Maneuver, PathEnd

Medium = imc.VehicleMedium.Medium


class Launch(Maneuver):
    """Waits without control until the vehicle is in the water, then goes to a point."""

    loops: ClassVar[int | None] = None
    subscribed: ClassVar[tuple[type[imc.Message], ...]] = (imc.PathControlState, imc.VehicleMedium)

    async def execute(self, launch: imc.Launch) -> None:
        medium = Medium.UNKNOWN
        while medium not in (Medium.WATER, Medium.UNDERWATER):
            event = await self.next_message()
            if isinstance(event, imc.VehicleMedium):
                medium = event.medium
        self.set_control_loops(Loops.PATH)
        await self.go_to_end(PathEnd.from_maneuver(launch))
