"""Stays at a point in the air."""

import math

import imc
from tasks.maneuver.maneuver_task import Completed, Maneuver, ManeuverError, PathEnd, PathFlags

FARTHEST = 10.0  # m from the point at which the vehicle has still stayed there


async def hover(maneuver: Maneuver, leg: PathEnd, seconds: float) -> None:
    """Go to the end of `leg` and stay there under path control for `seconds` from the arrival; 0 is forever.

    ManeuverDone ends it if the maneuver subscribes to that, as StationKeeping does and Loiter does not. Raises
    ManeuverError if the vehicle is elsewhere at the end, driven off by the wind.
    """
    maneuver.start_path(leg, flags=PathFlags.DIRECT)
    end = math.inf
    while maneuver.now < end:
        event = await maneuver.next_message()
        if isinstance(event, imc.ManeuverDone):
            raise Completed
        if event is not maneuver.path:
            continue
        if not maneuver.is_near_end:
            maneuver.report_time_left(after=seconds or math.inf)
            continue
        if end == math.inf and seconds:
            end = maneuver.now + seconds
        maneuver.report_progress(end - maneuver.now)
    if maneuver.state is not None and (distance := maneuver.range_to(leg)) > FARTHEST:
        raise ManeuverError(f"{distance:.0f} m from the point at the end")
