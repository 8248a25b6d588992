"""Covers an area in parallel rows."""

import math
from collections.abc import Callable

import imc
from imc.coordinates import maneuver_corner_offsets
from support.planar_geometry import remaining_distances
from support.wgs84 import displace
from tasks.maneuver.maneuver_task import Maneuver, ManeuverError, PathEnd

APPROACH = 2  # corners before the first row


async def follow_rows(
    maneuver: Maneuver, area: imc.Rows | imc.RowsCoverage, swath: Callable[[], float] | None = None
) -> None:
    """Go along all rows, at most `swath()` m apart. Raises ManeuverError if the rows are invalid."""
    leg = PathEnd.from_maneuver(area)
    try:
        left = remaining_distances(list(maneuver_corner_offsets(area))) if swath is None else []
        for number, (north, east) in enumerate(maneuver_corner_offsets(area, swath)):
            lat, lon, _ = displace(area.lat, area.lon, 0.0, north, east)
            end, on_row = leg._replace(lat=lat, lon=lon), number >= APPROACH
            after = leg.duration(left[number]) if left else math.inf  # spacing follows the water: the rows are unknown
            await maneuver.go_to_end(end, info=f"waypoint={number}", judged=on_row, after=after)
    except ValueError as error:
        raise ManeuverError(str(error)) from None
