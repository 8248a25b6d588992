"""Covers an area in parallel rows."""

import imc
from imc import patterns
from imc.coordinates import displace
from tasks.maneuver.protocol import Leg, Maneuver, ManeuverError

Flags = imc.Rows.Flags


class Rows(Maneuver):
    """Goes along rows of a given distance; done at the end of the last."""

    async def execute(self, r: imc.Rows) -> None:
        try:
            corners = patterns.rows(
                bearing=r.bearing,
                cross_angle=r.cross_angle,
                width=r.width,
                length=r.length,
                step=r.hstep,
                overshoot=r.coff,
                alternation=r.alternation / 100.0,
                square=bool(r.flags & Flags.SQUARE_CURVE),
                right=bool(r.flags & Flags.CURVE_RIGHT),
            )
        except ValueError as error:
            raise ManeuverError(str(error)) from None
        leg = Leg.of(r)
        for number, (north, east) in enumerate(corners):
            lat, lon, _ = displace(r.lat, r.lon, 0.0, north, east)
            await self.follow(leg._replace(lat=lat, lon=lon), info=f"waypoint={number}")
