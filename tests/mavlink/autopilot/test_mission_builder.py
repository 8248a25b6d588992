"""What a plan becomes as the mission of an autopilot, and what no item says."""

import math

import pytest

import imc
from mavlink.autopilot.leg import Leg, ReportedPosition
from mavlink.autopilot.mission_builder import (
    LandingApproach,
    MissionBuilder,
    choose_landing_approach,
    find_leg_item,
    item_group_start,
)
from mavlink.autopilot.vehicle_modes import ARDUPILOT, PX4, steered_vehicle
from mavlink.missions import MissionCommand
from shoal.missions import parse_plan
from support.wgs84 import displace, displacement

HERE = ReportedPosition(math.radians(41.185), math.radians(-8.7062), amsl=40.0, above_home=10.0, psi=1.0)
FINAL = LandingApproach(400.0, 30.0, math.radians(90.0))


def write(text, kind=2, autopilot=ARDUPILOT, **more):
    plan = parse_plan("plan: p\norigin: 41.185°, -8.7062°\nspeed: 5 m/s\naltitude: 20\nmaneuvers:\n" + text)
    return MissionBuilder(steered_vehicle(autopilot, kind), HERE, 54.6, FINAL, **more).build_plan_items(plan)


def commands(items):
    return [MissionCommand(item.command).name.removeprefix("NAV_") for item in items]


def test_a_flight_of_a_copter():
    items = write("""
  - takeoff: {altitude: 6, speed: 2 m/s}
  - goto: {north: 20, height: 104.6}
  - station_keeping: {north: 20, duration: 30}
  - loiter: {north: 0, radius: 10, duration: 60, direction: CCLOCKW}
  - land: {north: 5}
""")
    assert commands(items) == [
        "WAYPOINT", "TAKEOFF", "DO_CHANGE_SPEED", "WAYPOINT", "LOITER_TIME", "LOITER_TURNS", "LAND",
    ]  # fmt: skip
    home, up, speed, there, stay, turns, down = items
    assert (home.frame, home.z) == (0, 30.0)
    assert (up.frame, up.z) == (6, 6.0)
    assert (speed.param1, speed.param2) == (1.0, 5.0)
    assert there.z == pytest.approx(20.0)  # 104.6 m above the ellipsoid, geoid 54.6 m, home 30 m
    assert stay.param1 == 40.0  # longer than Shoal stays
    assert (turns.param1, turns.param3) == (6.0, -10.0)
    assert down.z == 0.0


def test_px4_has_no_home_as_its_first_item_and_a_submarine_goes_down():
    assert commands(write("  - goto: {north: 20}\n", autopilot=PX4)) == ["DO_CHANGE_SPEED", "WAYPOINT"]
    assert write("  - goto: {north: 20, depth: 4}\n", kind=12)[-1].z == -4.0


def test_a_plane_lands_on_its_course():
    items = write("  - takeoff: {altitude: 30}\n  - land: {north: 0, east: 0}\n", kind=1)
    assert commands(items)[-3:] == ["LOITER_TO_ALT", "WAYPOINT", "LAND"]
    begin, passing, end = items[-3:]
    spots = [(math.radians(item.x / 1e7), math.radians(item.y / 1e7)) for item in (begin, passing, end)]
    north, east, _ = displacement(*spots[2], 0.0, *spots[0], 0.0)
    assert (north, east) == pytest.approx((0.0, -400.0), abs=0.1)
    assert (begin.z, passing.z, end.z) == (30.0, 18.0, 0.0)
    assert item_group_start(items, len(items) - 1) == len(items) - 3


@pytest.mark.parametrize(
    ("wind", "course"),
    [((-4.0, 0.0), 0.0), ((0.0, 3.0), -math.pi / 2), ((0.1, 0.1), HERE.psi), (None, HERE.psi)],
)
def test_a_plane_lands_against_the_wind(wind, course):
    blows = imc.EstimatedStreamVelocity(x=wind[0], y=wind[1]) if wind else None
    assert choose_landing_approach(400.0, 30.0, None, blows, HERE).course == pytest.approx(course)
    assert choose_landing_approach(400.0, 30.0, 2.0, blows, HERE).course == 2.0


@pytest.mark.parametrize(
    ("text", "kind", "autopilot", "words"),
    [
        ("  - loiter: {north: 0, radius: 9, duration: 9, type: EIGHT, length: 30}\n", 2, 3, "figures of eight"),
        ("  - loiter: {north: 0, radius: 9, duration: 9}\n", 2, 12, "PX4 has no circles"),
        ("  - loiter: {north: 0, radius: 9, duration: 0}\n", 11, 3, "circle without end"),
        ("  - idle: {duration: 0}\n", 2, 3, "a wait without end"),
        ("  - idle: {duration: 5}\n", 1, 3, "a plane cannot wait"),
        ("  - goto: {north: 5, depth: 3}\n", 2, 3, "cannot go to a depth"),
        ("  - goto: {north: 5, depth: 3}\n", 11, 3, "cannot dive"),
        ("  - goto: {north: 5, speed: 900 rpm}\n", 2, 3, "must be in m/s"),
        ("  - yo_yo: {north: 5, depth: 3, amplitude: 1, pitch: 10}\n", 12, 3, "does not support YoYo"),
    ],
)
def test_what_no_item_says_is_refused_with_the_maneuver(text, kind, autopilot, words):
    text = text if "depth" in text or kind != 11 else text.replace("duration", "depth: 0, duration")
    with pytest.raises(ValueError, match=r"\d: .*" + words):
        write(text, kind, autopilot)


def test_conditions_are_refused():
    text = "  - goto: {north: 5}\n    then:\n      - {to: Goto1, when: FuelLevel.value < 20}\n      - Goto2\n"
    with pytest.raises(ValueError, match="conditions"):
        write(text + "  - goto: {north: 9}\n")


def leg(north, **flags):
    lat, lon, _ = displace(HERE.lat, HERE.lon, 0.0, north, 0.0)
    path = imc.DesiredPath(end_lat=lat, end_lon=lon, speed=3.0, speed_units=imc.SpeedUnits.METERS_PS, **flags)
    return Leg(path, HERE, 20.0)


def test_a_leg_finds_its_item():
    items = write("  - takeoff: {altitude: 6}\n" + "".join(f"  - goto: {{north: {n}}}\n" for n in (20, 0, 20)))
    found = find_leg_item(leg(20), items, 1)
    assert found is not None
    assert find_leg_item(leg(20), items, found + 1) == found + 2
    assert find_leg_item(leg(5), items, 1) is None
    assert (
        items[find_leg_item(leg(7, flags=imc.DesiredPath.Flags.TAKEOFF), items, 1)].command
        == MissionCommand.NAV_TAKEOFF
    )
