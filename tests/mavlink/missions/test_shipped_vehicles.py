"""The shipped vehicles accept and fly what missions become."""

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mission_samples import (
    ARDUPILOT,
    BOAT,
    COPTER,
    NAN,
    PX4,
    SIGNED,
    SUBMARINE,
    bare,
    item,
    usual_missions,
    waypoint,
)

import imc
from autonomy.plans import Preflight, parse_graph, remaining_plan
from mavlink.missions import COMMANDS, BadItem, MissionCommand, home_item, items_of, plan_of
from runtime.vehicle import general_number
from shoal import fly
from shoal.missions import parse_plan, prepare
from tasks.maneuver import Maneuver
from tasks.plan.actions import unsupported_setting_reasons
from tests.repeats import repeat

C = MissionCommand
PROFILES = {"lauv-noptilus-1": SUBMARINE, "otter": BOAT, "caravel": BOAT, "hexa-00": COPTER}
CAMERA = {C.IMAGE_STOP_CAPTURE, C.VIDEO_START_CAPTURE, C.VIDEO_STOP_CAPTURE, C.DO_SET_CAM_TRIGG_DIST}
SEABED = 8.0  # m below the vehicle


def vehicle_of(profile, folder, modes=()):
    """A vehicle that is built but not started, and the maneuvers that it knows."""
    vehicle = prepare(profile, modes, log_root=folder / "log", state_folder=folder / "db").vehicle
    return vehicle, {task.message_type().ID for task in vehicle.tasks if isinstance(task, Maneuver)}


@pytest.fixture(scope="module", params=sorted(PROFILES))
def shipped(request, tmp_path_factory):
    """The settings for a profile, the check of its plan engine, and the maneuvers that it knows."""
    vehicle, known = vehicle_of(request.param, tmp_path_factory.mktemp(request.param))
    profile = vehicle.profile
    limits = {
        "deepest": max(0.0, general_number(profile, "Absolute Maximum Depth", math.inf) - 1.0),
        "highest": general_number(profile, "Absolute Maximum Altitude", math.inf) - 1.0,
        "fastest": general_number(profile, "Maximum Absolute Speed", math.inf),
    }
    preflight = Preflight(lambda option: profile.value("General", option), 15.0, 5000.0)
    return replace(PROFILES[request.param], **limits), preflight, known


@settings(max_examples=30)
@given(data=st.data(), flavor=st.sampled_from((PX4, ARDUPILOT)))
def test_what_is_accepted_can_be_started(shipped, data, flavor):
    craft = shipped[0]
    items = data.draw(usual_missions(craft))
    start(shipped, [*[home_item(craft.home)] * (flavor is ARDUPILOT), *items], flavor)


@pytest.mark.parametrize("command", sorted(set(COMMANDS) - CAMERA))
def test_what_is_accepted_of_extreme_numbers_can_be_started(shipped, command):
    z = 20.0 if shipped[0].flies else 0.0
    usual = item(command, 20, 0, z, 1, 0, 0, 0)
    for field in ("param1", "param2", "param3", "z"):
        for number in SIGNED:
            odd = usual._replace(**{field: number})
            start(shipped, [odd, waypoint(10, 0, z)] if command == C.DO_CHANGE_SPEED else [odd], PX4)


def start(shipped, items, flavor):
    """Have the plan engine check a mission, if it is accepted."""
    craft, preflight, known = shipped
    try:
        plan, _ = plan_of(items, flavor, craft)
    except BadItem:
        return
    home, altitude = craft.home, 0.0 if craft.flies else SEABED
    state = imc.EstimatedState(lat=home.lat, lon=home.lon, height=home.height, alt=altitude)
    preflight.check(plan, known, state, None, 0.0)


def flown(items, craft, profile, flavor=PX4):
    plan, table = plan_of(items, flavor, craft)
    report = fly(plan, profile, limit=1500)
    assert report.completed, report.reason
    assert report.maneuvers == [name for ids in table.steps for name in ids]
    return report


@pytest.mark.heavy
def test_the_auv_flies_a_mission():
    items = [
        home_item(SUBMARINE.home),
        waypoint(25, 0, -2),
        bare(C.DO_CHANGE_SPEED, 1, 1.5, -1),
        item(C.NAV_LOITER_TIME, 40, 10, -2, 5, 0, 15),
        waypoint(20, 20, 3, frame=11),
        item(C.NAV_LAND, 0, 0, 0),
    ]
    report = flown(items, SUBMARINE, "lauv-noptilus-1", ARDUPILOT)
    assert report.maneuvers == ["Goto1", "StationKeeping3", "Goto4", "Goto5", "PopUp5"]
    assert report.deepest == pytest.approx(2.0, abs=0.5)
    assert report.cross_track < 6.0


@pytest.mark.heavy
@pytest.mark.parametrize("profile", ["otter", repeat("caravel")])
def test_a_boat_flies_a_mission(profile):
    items = [
        waypoint(25, 0, 0, 5, 15), item(C.NAV_LOITER_TURNS, 20, 10, 0, 0.5, 0, 15), bare(C.NAV_DELAY, 5),
        bare(C.NAV_RETURN_TO_LAUNCH),
    ]  # fmt: skip
    report = flown(items, BOAT, profile)
    assert report.maneuvers == ["Goto0", "StationKeeping0", "Loiter1", "StationKeeping2", "Goto3"]


@pytest.mark.heavy
def test_a_copter_flies_a_mission():
    """Begun with a waypoint, as with MAVSDK; with all that it can do."""
    items = [
        waypoint(20, 0, 10, 2, 0, 0, NAN), item(C.NAV_LOITER_TO_ALT, 20, 0, 20), waypoint(20, 10, 40, frame=0),
        waypoint(10, 10, 15, frame=10), item(C.NAV_LOITER_TURNS, 20, 0, 20, 1, 0, -10),
        item(C.NAV_SPLINE_WAYPOINT, 0, 0, 15), bare(C.NAV_RETURN_TO_LAUNCH),
    ]  # fmt: skip
    report = flown(items, COPTER, "hexa-00")
    assert report.maneuvers[:2] == ["Takeoff0", "Goto0"]
    assert report.maneuvers[-1] == "Land6"
    assert report.depth_error <= 0.5


def test_a_copter_flies_the_rest_of_a_mission():
    items = [item(C.NAV_TAKEOFF, 0, 0, 10), waypoint(300, 0, 10), waypoint(20, 0, 10), item(C.NAV_LAND, 0, 0)]
    plan, table = plan_of(items, PX4, COPTER)
    report = fly(remaining_plan(plan, table.maneuver_at(2), takeoff=True), "hexa-00", limit=300)
    assert report.completed, report.reason
    assert report.maneuvers == ["Takeoff0", "Goto2", "Land3"]
    assert report.distance < 100.0


def test_a_plan_of_a_console_flies_the_same_as_a_mission():
    plan = parse_plan("""
plan: harbor
origin: 41.185°, -8.7062°
speed: 1.5 m/s
depth: 0
maneuvers:
  - goto: {north: 30}
  - station_keeping: {north: 20, east: 20, speed: 1.2 m/s, radius: 15, duration: 5}
""")
    listed = items_of(plan, PX4, BOAT)
    assert listed.remarks == []
    report = flown(listed.items, BOAT, "otter")
    assert report.maneuvers == ["Goto0", "StationKeeping2"]
    assert report.distance == pytest.approx(50.0, abs=10.0)


@pytest.mark.parametrize(("profile", "craft"), [("lauv-noptilus-1", SUBMARINE), ("otter", BOAT)])
def test_a_shipped_camera_is_switched(profile, craft, tmp_path):
    vehicle, known = vehicle_of(profile, tmp_path, ("Simulation", "Camera"))
    plan, _ = plan_of([bare(C.IMAGE_START_CAPTURE), waypoint(10), bare(C.IMAGE_STOP_CAPTURE)], PX4, craft)
    assert list(unsupported_setting_reasons(parse_graph(plan, known), vehicle)) == []
    wrong, _ = plan_of([bare(C.IMAGE_START_CAPTURE), waypoint(10)], PX4, replace(craft, camera="Fisheye"))
    assert list(unsupported_setting_reasons(parse_graph(wrong, known), vehicle))
