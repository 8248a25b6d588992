"""The rest of a plan for a vehicle in the middle of one of its maneuvers."""

import math
from itertools import pairwise

import imc
from autonomy.plans.estimate import LatLon, waypoints
from autonomy.plans.sequence import remaining_plan
from support.wgs84 import offset

NEAR = 15.0  # m beyond the nearest leg, within which a vehicle may as well be on another leg
BEFORE = -1  # instead of the number of a leg: on the way to the first point
PATHS = imc.FollowPath | imc.Rows | imc.RowsCoverage
STAYS = imc.Loiter | imc.StationKeeping | imc.IdleManeuver
LONGEST_STAY = 65535  # s, of IMC's durations


def remaining_plan_at(
    plan: imc.PlanSpecification, maneuver: str, place: LatLon, seconds_left: float = math.nan
) -> imc.PlanSpecification:
    """The plan from a place (rad) in a maneuver on, of which `seconds_left` (s) are left, NaN if that is unknown.

    Paths, rows and coverages continue with the leg at the place, or on the way to the first point; where several legs
    are near, with the one whose rest takes the time that is left. Stays with a duration keep the time that is left;
    each other maneuver begins anew. Raises
    ValueError for a maneuver that the plan does not have, and for invalid rows.
    """
    rest = remaining_plan(plan, maneuver)
    changed = tuple(
        item.replace(data=_rest_of(item.data, place, seconds_left))
        if isinstance(item, imc.PlanManeuver) and item.maneuver_id == maneuver and item.data is not None
        else item
        for item in rest.maneuvers
    )
    return rest.replace(maneuvers=changed)


def _rest_of(data: imc.Message, place: LatLon, seconds_left: float) -> imc.Message:
    if isinstance(data, PATHS):
        return _rest_of_path(data, place, seconds_left)
    if isinstance(data, STAYS) and seconds_left > 0.0 and getattr(data, "duration", 0) > 0:
        return data.replace(duration=min(LONGEST_STAY, data.duration, max(1, round(seconds_left))))
    return data


def _rest_of_path(data: PATHS, place: LatLon, seconds_left: float) -> imc.Message:
    corners = waypoints(data)
    lat, lon = place
    points = [offset(lat, lon, *corner) for corner in corners]
    legs = list(pairwise(points))
    if not legs:
        return data
    lengths = [math.dist(*leg) for leg in legs]
    distances = [_distance_to_leg(*leg) for leg in legs]
    speed = data.speed if data.speed_units == imc.SpeedUnits.METERS_PS else math.nan
    wanted = seconds_left * speed

    def misfit(number: int) -> float:
        left = math.dist((0.0, 0.0), points[number + 1]) + math.fsum(lengths[number + 1 :])
        return abs(left - wanted) if wanted >= 0.0 else float(number)

    near = [number for number, each in enumerate(distances) if each <= min(distances) + NEAR]
    approaches = [BEFORE] if wanted >= 0.0 or min(distances) > NEAR else []
    number = min(approaches + near, key=misfit)
    rest = points[number + 1 :]
    heights = _heights(data)[number + 1 :] or [0.0] * len(rest)
    return imc.FollowPath(
        timeout=getattr(data, "timeout", 0),
        lat=lat,
        lon=lon,
        z=data.z,
        z_units=data.z_units,
        speed=data.speed,
        speed_units=data.speed_units,
        points=tuple(imc.PathPoint(x=x, y=y, z=z) for (x, y), z in zip(rest, heights, strict=True)),
        custom=getattr(data, "custom", ""),
    )


def _heights(data: PATHS) -> list[float]:
    points = data.points if isinstance(data, imc.FollowPath) else ()
    return [point.z for point in points if isinstance(point, imc.PathPoint)]


def _distance_to_leg(start: tuple[float, float], end: tuple[float, float]) -> float:
    """Distance (m) of the origin from a leg between two points."""
    (x, y), (dx, dy) = start, (end[0] - start[0], end[1] - start[1])
    length = dx * dx + dy * dy
    share = 0.0 if length == 0.0 else min(1.0, max(0.0, -(x * dx + y * dy) / length))
    return math.hypot(x + share * dx, y + share * dy)
