"""Covers an area in parallel rows."""

import imc
from imc.coordinates import displace, rows_of
from tasks.maneuver.protocol import Leg, Maneuver, ManeuverError


async def cover(maneuver: Maneuver, area: imc.Rows | imc.RowsCoverage) -> None:
    """Go along all rows. Raises ManeuverError if the rows are invalid."""
    try:
        corners = rows_of(area)
    except ValueError as error:
        raise ManeuverError(str(error)) from None
    leg = Leg.of(area)
    for number, (north, east) in enumerate(corners):
        lat, lon, _ = displace(area.lat, area.lon, 0.0, north, east)
        await maneuver.follow(leg._replace(lat=lat, lon=lon), info=f"waypoint={number}")
