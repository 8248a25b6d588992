"""Leaves the ground."""

import imc
from tasks.maneuver.maneuver_task import Maneuver, PathEnd, PathFlags


class Takeoff(Maneuver):
    """Climbs straight up to a height or an altitude, from the ground or in the air."""

    async def execute(self, takeoff: imc.Takeoff) -> None:
        await self.go_to_end(PathEnd.from_maneuver(takeoff), flags=PathFlags.TAKEOFF)
