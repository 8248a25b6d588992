"""Comes down to the ground."""

import imc
from imc.coordinates import absolute
from tasks.maneuver.protocol import Leg, Maneuver, PathFlags

NOWHERE = (0.0, 0.0)


class Land(Maneuver):
    """Goes to a position at a height and from there straight down; done when the motors rest.

    Without a position, latitude and longitude 0, it comes down where it is; without a height it goes there at its own.
    """

    hears = (imc.PathControlState, imc.EstimatedState)

    async def execute(self, land: imc.Land) -> None:
        leg = Leg.of(land)
        if (leg.lat, leg.lon) == NOWHERE:
            lat, lon, _ = absolute(await self.located())
            leg = leg._replace(lat=lat, lon=lon, z_units=imc.ZUnits.NONE)
        await self.follow(leg, flags=PathFlags.LAND)
