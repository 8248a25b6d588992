"""Lands on the ground."""

from typing import ClassVar

import imc
from imc.coordinates import absolute_position
from runtime import param
from tasks.maneuver.maneuver_task import Maneuver, ManeuverError, PathEnd, PathFlags

NOWHERE = (0.0, 0.0)


class Land(Maneuver):
    """Goes to a position at a height, then straight down; done when the motors stop.

    Without a position (latitude and longitude 0) it lands where it is; without a height it keeps its own on the way.
    A vehicle that stands on the ground elsewhere, since the height is below it, has failed.
    """

    landing_radius: float = param(
        10.0, "m", "Largest distance from the position; a fixed wing rolls out beyond it.", minimum=1.0
    )

    subscribed: ClassVar[tuple[type[imc.Message], ...]] = (imc.PathControlState, imc.EstimatedState)

    async def execute(self, land: imc.Land) -> None:
        leg = PathEnd.from_maneuver(land)
        if (leg.lat, leg.lon) == NOWHERE:
            lat, lon, _ = absolute_position(await self.wait_for_state())
            leg = leg._replace(lat=lat, lon=lon, z_units=imc.ZUnits.NONE)
        await self.go_to_end(leg, flags=PathFlags.LAND, judged=False)
        await self.wait_for_state()
        if (distance := self.range_to(leg)) > self.landing_radius:
            raise ManeuverError(f"landed {distance:.0f} m from the position")
