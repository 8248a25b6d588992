"""Covers an area with a sonar."""

import imc
from imc import patterns
from imc.coordinates import displace
from tasks.maneuver.protocol import Leg, Maneuver, ManeuverError

Flags = imc.RowsCoverage.Flags


class RowsCoverage(Maneuver):
    """Goes along rows whose distance follows from a sonar's aperture, range and the overlap of its swaths."""

    async def execute(self, r: imc.RowsCoverage) -> None:
        try:
            corners = patterns.rows(
                bearing=r.bearing,
                cross_angle=r.cross_angle,
                width=r.width,
                length=r.length,
                step=patterns.swath(r.angaperture, r.range, r.overlap / 100.0),
                overshoot=r.coff,
                square=bool(r.flags & Flags.SQUARE_CURVE),
                right=bool(r.flags & Flags.CURVE_RIGHT),
            )
        except ValueError as error:
            raise ManeuverError(str(error)) from None
        leg = Leg.of(r)
        for number, (north, east) in enumerate(corners):
            lat, lon, _ = displace(r.lat, r.lon, 0.0, north, east)
            await self.follow(leg._replace(lat=lat, lon=lon), info=f"waypoint={number}")
