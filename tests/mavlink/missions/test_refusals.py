"""What cannot be flown is refused, with item, result and reason; nothing else is raised."""

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mission_samples import (
    ABSOLUTE,
    ARDUPILOT,
    BOAT,
    COPTER,
    FLOATS,
    GARBAGE,
    NAN,
    PLANE,
    PX4,
    SUBMARINE,
    TERRAIN,
    VEHICLES,
    bare,
    item,
    on_wire,
    usual_missions,
    waypoint,
    without_home,
)

import imc
from mavlink.missions import MOST_ITEMS, BadItem, Item, MissionCommand, MissionResult, plan_of

C, R = MissionCommand, MissionResult
AREA = imc.OperationalLimits(
    mask=imc.OpLimitsMask.AREA, lat=BOAT.home.lat, lon=BOAT.home.lon, length=200.0, width=100.0
)
DEPTH, ALTITUDE, HEIGHT, NONE = imc.ZUnits.DEPTH, imc.ZUnits.ALTITUDE, imc.ZUnits.HEIGHT, imc.ZUnits.NONE


def refusal(items, settings=SUBMARINE, flavor=PX4):
    """Number, result and reason of the refusal of a mission."""
    with pytest.raises(BadItem) as caught:
        plan_of(items, flavor, settings)
    return caught.value.seq, caught.value.result, str(caught.value)


@pytest.mark.parametrize(
    ("items", "settings", "result", "text"),
    [
        ([], SUBMARINE, R.INVALID, "item 0 (NAV_WAYPOINT): the mission has no item that moves the vehicle"),
        ([waypoint(1)._replace(z=0.5)], SUBMARINE, R.INVALID_PARAM7,
         "item 0 (NAV_WAYPOINT): altitude 0.5 m is above the surface; depths are negative altitudes"),
        ([waypoint(1, 0, -50)], SUBMARINE, R.INVALID_PARAM7,
         "item 0 (NAV_WAYPOINT): depth 50 m is below the vehicle's limit of 49 m"),
        ([waypoint(1, 0, -1, frame=TERRAIN)], SUBMARINE, R.INVALID_PARAM7,
         "item 0 (NAV_WAYPOINT): altitude -1 m is below the seabed"),
        ([waypoint(1), waypoint(1)._replace(z=NAN)], SUBMARINE, R.INVALID_PARAM7,
         "item 1 (NAV_WAYPOINT): altitude is not a number"),
        ([waypoint(1)._replace(z=math.inf)], BOAT, R.INVALID_PARAM7,
         "item 0 (NAV_WAYPOINT): altitude inf m is out of range"),
        ([waypoint(1, 0, -1)], BOAT, R.INVALID_PARAM7,
         "item 0 (NAV_WAYPOINT): altitude -1 m is below the surface, and a boat stays there"),
        ([waypoint(1, 0, 1, frame=TERRAIN)], BOAT, R.UNSUPPORTED_FRAME,
         "item 0 (NAV_WAYPOINT): frame 11: a boat cannot keep an altitude"),
        ([waypoint(1, 0, 121)], COPTER, R.INVALID_PARAM7,
         "item 0 (NAV_WAYPOINT): altitude 121 m is above the vehicle's limit of 120 m"),
        ([waypoint(1, 0, 151, frame=ABSOLUTE)], COPTER, R.INVALID_PARAM7,
         "item 0 (NAV_WAYPOINT): altitude 121 m is above the vehicle's limit of 120 m"),
        ([waypoint(1, 0, -1, frame=TERRAIN)], COPTER, R.INVALID_PARAM7,
         "item 0 (NAV_WAYPOINT): altitude -1 m is below the ground"),
        ([waypoint(1, 0, 20, frame=ABSOLUTE)], COPTER, R.INVALID_PARAM7,
         "item 0 (NAV_WAYPOINT): altitude -10 m above home is below the ground there"),
        ([waypoint(1), waypoint(200)], replace(BOAT, area=AREA), R.INVALID,
         "item 1 (NAV_WAYPOINT): is outside the fence, the area of the operational limits"),
        ([waypoint(1), item(18, 30, 0, 0, 2, 0, 75)], replace(BOAT, area=AREA), R.INVALID,
         "item 1 (NAV_LOITER_TURNS): is outside the fence, the area of the operational limits"),
        ([waypoint(1, 0, 20)], without_home(COPTER), R.ERROR,
         "item 0 (NAV_WAYPOINT): home is not known yet, so altitudes mean nothing"),
        ([waypoint(1)._replace(x=900_000_001)], BOAT, R.INVALID_PARAM5_X,
         "item 0 (NAV_WAYPOINT): latitude 900000001 is out of range; it counts 1e-7 degrees"),
        ([waypoint(1)._replace(y=-1_800_000_001)], BOAT, R.INVALID_PARAM6_Y,
         "item 0 (NAV_WAYPOINT): longitude -1800000001 is out of range; it counts 1e-7 degrees"),
        ([Item(6, 16)], BOAT, R.INVALID_PARAM5_X,
         "item 0 (NAV_WAYPOINT): has no position, and no item before it has one"),
        ([waypoint(1, frame=1)], BOAT, R.UNSUPPORTED_FRAME,
         "item 0 (NAV_WAYPOINT): frame 1 has no meaning for a mission"),
        ([waypoint(1, frame=2)], BOAT, R.UNSUPPORTED_FRAME,
         "item 0 (NAV_WAYPOINT): frame 2 has no meaning for a position"),
        ([waypoint(1), item(177, 0, 0, 0, 0, 3)], BOAT, R.UNSUPPORTED,
         "item 1 (command 177): DO_JUMP is not supported: items are flown once, in their order"),
        ([item(30001)], BOAT, R.UNSUPPORTED, "item 0 (command 30001): is not supported in a mission"),
        ([waypoint(1)._replace(mission_type=1)], BOAT, R.INVALID,
         "item 0 (NAV_WAYPOINT): is part of a fence or a rally point, not of a mission"),
        ([waypoint(1, 0, 0, -1)], BOAT, R.INVALID_PARAM1,
         "item 0 (NAV_WAYPOINT): hold time -1 is not between 0 and 65535"),
        ([waypoint(1, 0, 0, 0, math.inf)], BOAT, R.INVALID_PARAM2, "item 0 (NAV_WAYPOINT): parameter 2 is infinite"),
        ([waypoint(1, 0, 0, 0, 0, 5)], BOAT, R.INVALID_PARAM3,
         "item 0 (NAV_WAYPOINT): the vehicle cannot pass at a distance"),
        ([waypoint(1, 0, 0, 0, 0, 0, 361)], BOAT, R.INVALID_PARAM4,
         "item 0 (NAV_WAYPOINT): yaw 361 is not between -360 and 360"),
        ([item(C.NAV_LOITER_TIME, 0, 0, 0, NAN)], BOAT, R.INVALID_PARAM1,
         "item 0 (NAV_LOITER_TIME): time nan is not between 0 and 65535"),
        ([item(C.NAV_LOITER_TURNS, 0, 0, 0, 0)], BOAT, R.INVALID_PARAM1,
         "item 0 (NAV_LOITER_TURNS): 0 turns take 0 s, not 1 to 65535 s"),
        ([bare(C.DO_CHANGE_SPEED, 1, -1, 40), item(C.NAV_LOITER_TURNS, 0, 0, 0, 1)], BOAT, R.INVALID_PARAM1,
         "item 1 (NAV_LOITER_TURNS): turns need a speed in m/s, not in %"),
        ([item(C.NAV_LOITER_TO_ALT)], BOAT, R.UNSUPPORTED, "item 0 (NAV_LOITER_TO_ALT): a boat stays at the surface"),
        ([bare(C.NAV_DELAY, -1, 12)], BOAT, R.INVALID_PARAM1,
         "item 0 (NAV_DELAY): the vehicle cannot wait for a time of day"),
        ([waypoint(1, 0, NAN)], BOAT, R.INVALID_PARAM7, "item 0 (NAV_WAYPOINT): altitude is not a number"),
        ([item(C.NAV_LAND)], BOAT, R.UNSUPPORTED, "item 0 (NAV_LAND): a boat does not land"),
        ([item(C.NAV_LAND, 0, 0, 0, 0, 2)], COPTER, R.INVALID_PARAM2,
         "item 0 (NAV_LAND): the vehicle has no precision landing"),
        ([item(C.NAV_TAKEOFF)], SUBMARINE, R.UNSUPPORTED,
         "item 0 (NAV_TAKEOFF): only an aircraft takes off; a NAV_WAYPOINT begins a dive"),
        ([item(C.NAV_TAKEOFF)], COPTER, R.INVALID_PARAM7, "item 0 (NAV_TAKEOFF): altitude 0 m is not above the ground"),
        ([item(C.NAV_TAKEOFF, 0, 0, 9), item(C.NAV_LAND), waypoint(9, 0, 9)], COPTER, R.INVALID,
         "item 2 (NAV_WAYPOINT): flies after a landing; a NAV_TAKEOFF must come between"),
        ([waypoint(1, 0, 0)], replace(COPTER, z=0.0), R.INVALID,
         "item 0 (NAV_WAYPOINT): flies at the height of the ground; a NAV_TAKEOFF must come before"),
        ([bare(C.NAV_RETURN_TO_LAUNCH)], without_home(BOAT), R.ERROR,
         "item 0 (NAV_RETURN_TO_LAUNCH): home is not known yet"),
        ([bare(C.NAV_RETURN_TO_LAUNCH), waypoint(1)], BOAT, R.INVALID,
         "item 1 (NAV_WAYPOINT): comes after a return to launch, which ends a mission"),
        ([bare(C.DO_CHANGE_SPEED, 1, 2.5)], SUBMARINE, R.INVALID_PARAM2,
         "item 0 (DO_CHANGE_SPEED): 2.5 m/s is above the vehicle's 2 m/s"),
        ([bare(C.DO_CHANGE_SPEED, 1, 0)], BOAT, R.INVALID_PARAM2, "item 0 (DO_CHANGE_SPEED): 0 m/s is no speed"),
        ([bare(C.DO_CHANGE_SPEED, 1, 1e-40), item(C.NAV_LOITER_TURNS, 0, 0, 0, 1)], BOAT, R.INVALID_PARAM2,
         "item 0 (DO_CHANGE_SPEED): 1e-40 m/s is no speed"),
        ([bare(C.DO_CHANGE_SPEED, 1, 101)], BOAT, R.INVALID_PARAM2,
         "item 0 (DO_CHANGE_SPEED): speed 101 is not between -2 and 100"),
        ([waypoint(1, 0, 10_950)], PLANE, R.INVALID_PARAM7,
         "item 0 (NAV_WAYPOINT): height 11034.6 m above the ellipsoid is out of range"),
        ([bare(C.DO_CHANGE_SPEED, 2, 1)], BOAT, R.INVALID_PARAM1,
         "item 0 (DO_CHANGE_SPEED): the vertical speed cannot be set"),
        ([bare(C.DO_CHANGE_SPEED, 1, -1, 101)], BOAT, R.INVALID_PARAM3,
         "item 0 (DO_CHANGE_SPEED): throttle 101 is not between -2 and 100"),
        ([bare(C.DO_CHANGE_SPEED, 1, -1, 50)], COPTER, R.INVALID_PARAM3,
         "item 0 (DO_CHANGE_SPEED): an aircraft needs a speed in m/s, not a throttle"),
        ([bare(C.DO_CHANGE_SPEED, 1, 1, -1, 1)], BOAT, R.INVALID_PARAM4,
         "item 0 (DO_CHANGE_SPEED): a change relative to the present speed is not supported"),
        ([bare(C.DO_CHANGE_SPEED, 1, 1)], BOAT, R.INVALID,
         "item 0 (DO_CHANGE_SPEED): the mission has no item that moves the vehicle"),
        ([bare(C.IMAGE_START_CAPTURE)], COPTER, R.UNSUPPORTED,
         "item 0 (IMAGE_START_CAPTURE): the vehicle has no camera that a plan can switch"),
        ([bare(C.IMAGE_START_CAPTURE, 0, 0, 1)], BOAT, R.INVALID_PARAM3,
         "item 0 (IMAGE_START_CAPTURE): a plan only switches a camera on and off"),
        ([bare(C.DO_SET_CAM_TRIGG_DIST, 0, 0, 1)], BOAT, R.INVALID_PARAM3,
         "item 0 (DO_SET_CAM_TRIGG_DIST): a plan only switches a camera on and off"),
        ([waypoint(1)] * (MOST_ITEMS + 1), BOAT, R.NO_SPACE,
         f"item {MOST_ITEMS} (NAV_WAYPOINT): a mission has at most {MOST_ITEMS} items"),
        ([waypoint(1, 0, 0, 9)] * 500, BOAT, R.NO_SPACE,
         "item 499 (NAV_WAYPOINT): the mission is too long for one plan"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)  # fmt: skip
def test_refusals_name_item_and_reason(items, settings, result, text):
    found = refusal(items, settings)
    assert found == (int(text.split()[1]), result, text)
    home = Item(0, 16)
    number = found[0] + 1
    shifted = text.replace(f"item {found[0]} ", f"item {number} ", 1)
    if items and result is not R.NO_SPACE:
        assert refusal([home, *items], settings, ARDUPILOT) == (number, result, shifted)


def test_a_mission_of_home_alone_is_empty():
    assert refusal([Item(0, 16)], BOAT, ARDUPILOT)[1] is R.INVALID


def test_a_mission_may_be_as_long_as_its_plan_fits_a_message():
    plan, _ = plan_of([waypoint(1, 0, -1)] * MOST_ITEMS, PX4, SUBMARINE)
    assert len(plan.maneuvers) == MOST_ITEMS


@settings(max_examples=100)
@given(st.lists(GARBAGE, max_size=3), st.sampled_from(sorted(VEHICLES)), st.sampled_from((PX4, ARDUPILOT)))
def test_any_items_are_a_plan_or_refused(items, vehicle, flavor):
    convert(items, vehicle, flavor)


@pytest.mark.heavy
@settings(max_examples=100)
@given(st.data(), st.sampled_from(sorted(VEHICLES)), st.sampled_from((PX4, ARDUPILOT)))
def test_usual_missions_with_a_wrong_item_are_a_plan_or_refused(data, vehicle, flavor):
    items = data.draw(usual_missions(VEHICLES[vehicle]))
    items.insert(data.draw(st.integers(0, len(items))), data.draw(GARBAGE))
    convert(items, vehicle, flavor)


@given(FLOATS, FLOATS, FLOATS, FLOATS, FLOATS, st.sampled_from([int(c) for c in MissionCommand]))
def test_any_numbers_are_a_plan_or_refused(p1, p2, p3, p4, z, command):
    convert([item(command, 1, 1, z, p1, p2, p3, p4)], "submarine", PX4)


@pytest.mark.parametrize("fields", [{"x": 10**400}, {"y": -(10**400)}, {"command": 10**400}, {"frame": -(10**40)}])
def test_huge_numbers_are_refused(fields):
    assert refusal([waypoint(1)._replace(**fields)])[0] == 0


def convert(items, vehicle, flavor):
    refused = None
    try:
        plan, table = plan_of(items, flavor, VEHICLES[vehicle])
    except BadItem as bad:
        refused = bad
    if refused is not None:
        assert 0 <= refused.seq <= len(items)
        assert refused.result not in (R.ACCEPTED, R.INVALID_SEQUENCE)
        assert str(refused).startswith(f"item {refused.seq} (")
        return
    assert on_wire(plan) == plan
    names = [name for ids in table.steps for name in ids]
    assert names == [m.maneuver_id for m in plan.maneuvers]
    assert len(set(names)) == len(names)
    assert len(table.steps) == len(items)
