"""Leaves the ground."""

import imc
from tasks.maneuver.maneuver_task import Leg, Maneuver, PathFlags


class Takeoff(Maneuver):
    """Climbs straight up to a height or an altitude, from the ground or in the air."""

    async def execute(self, takeoff: imc.Takeoff) -> None:
        await self.follow(Leg.of(takeoff), flags=PathFlags.TAKEOFF)
