"""The rest of a plan for a vehicle in the middle of a maneuver."""

import math

import pytest

import imc
from autonomy.plans import remaining_plan_at, sequential_plan, waypoints
from support.wgs84 import displace, offset

LAT, LON = math.radians(41.185), math.radians(-8.7062)
METERS = imc.SpeedUnits.METERS_PS


def place(north: float, east: float) -> tuple[float, float]:
    return displace(LAT, LON, 0.0, north, east)[:2]


def path(*points: tuple[float, float]) -> imc.FollowPath:
    made = tuple(imc.PathPoint(x=x, y=y, z=z) for z, (x, y) in enumerate(points))
    return imc.FollowPath(lat=LAT, lon=LON, z=2.0, z_units=1, speed=1.0, speed_units=METERS, points=made)


def rest(maneuver: imc.Message, north: float, east: float, seconds: float = math.nan) -> imc.Message:
    plan = sequential_plan("p", {"before": imc.IdleManeuver(), "now": maneuver, "after": imc.IdleManeuver()})
    found = remaining_plan_at(plan, "now", place(north, east), seconds)
    assert [item.maneuver_id for item in found.maneuvers] == ["now", "after"]
    return found.maneuvers[0].data


def corners(maneuver: imc.Message) -> list[tuple[float, float]]:
    return [(round(n), round(e)) for n, e in (offset(LAT, LON, *corner) for corner in waypoints(maneuver))]


def test_a_path_continues_with_the_leg_at_the_place():
    found = rest(path((0, 0), (0, 100), (50, 100), (50, 0)), 3.0, 60.0)
    assert corners(found) == [(0, 100), (50, 100), (50, 0)]
    assert [point.z for point in found.points] == [1.0, 2.0, 3.0]
    assert (found.z, found.speed, found.speed_units) == (2.0, 1.0, METERS)


@pytest.mark.parametrize(("seconds", "left"), [(180.0, 3), (30.0, 1)])
def test_where_two_legs_are_near_the_time_that_is_left_decides(seconds, left):
    legs = path((0, 0), (0, 100), (10, 100), (10, 0))
    assert len(rest(legs, 5.0, 40.0, seconds).points) == left


def test_a_vehicle_on_the_way_to_a_path_carries_out_all_of_it():
    legs = path((0, 0), (0, 100), (50, 100))
    assert corners(rest(legs, -80.0, -40.0)) == [(0, 0), (0, 100), (50, 100)]
    assert len(rest(legs, -8.0, 0.0, 158.0).points) == 3


def test_rows_continue_as_a_path():
    rows = imc.Rows(lat=LAT, lon=LON, width=60.0, length=100.0, hstep=30.0, speed=1.0, speed_units=METERS)
    all_corners = corners(rows)
    north, east = all_corners[-1]
    found = rest(rows, north, east, 0.0)
    assert isinstance(found, imc.FollowPath)
    assert corners(found) == all_corners[-1:]


def test_a_stay_keeps_the_time_that_is_left_and_others_begin_anew():
    assert rest(imc.StationKeeping(duration=600), 0.0, 0.0, 42.4).duration == 42
    assert rest(imc.StationKeeping(duration=0), 0.0, 0.0, 42.4).duration == 0
    assert rest(imc.Loiter(duration=600), 0.0, 0.0).duration == 600
    goto = imc.Goto(lat=LAT, lon=LON)
    assert rest(goto, 5.0, 5.0, 9.0) == goto


def test_a_maneuver_that_the_plan_lacks_is_an_error():
    with pytest.raises(ValueError, match="no maneuver 'x'"):
        remaining_plan_at(sequential_plan("p", {"a": imc.IdleManeuver()}), "x", place(0.0, 0.0))
