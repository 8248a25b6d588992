"""Goes to a point once the vehicle is in the water."""

import imc
from tasks.maneuver.maneuver_task import Leg, Loops, Maneuver

Medium = imc.VehicleMedium.Medium


class Launch(Maneuver):
    """Waits without control until the vehicle is in the water, then goes to a point."""

    loops = None
    hears = (imc.PathControlState, imc.VehicleMedium)

    async def execute(self, launch: imc.Launch) -> None:
        medium = Medium.UNKNOWN
        while medium not in (Medium.WATER, Medium.UNDERWATER):
            event = await self.event()
            if isinstance(event, imc.VehicleMedium):
                medium = event.medium
        self.control(Loops.PATH)
        await self.follow(Leg.of(launch))
