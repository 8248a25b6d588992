"""Any plan becomes items; what they can say comes back the same, and remarks name the rest."""

import math
from dataclasses import replace

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from mission_samples import (
    ARDUPILOT,
    BOAT,
    COPTER,
    GROUND,
    LAT,
    LON,
    NAN,
    PLANE,
    PX4,
    SUBMARINE,
    VEHICLES,
    X,
    Y,
    bare,
    float32,
    item,
    nameless,
    packed,
    usual_missions,
)

import imc
from mavlink.missions import MOST_ITEMS, BadItem, Item, MissionCommand, first_item_seq, home_item, items_of, plan_of
from support.wgs84 import displace

C = MissionCommand
DEPTH, ALTITUDE, HEIGHT = imc.ZUnits.DEPTH, imc.ZUnits.ALTITUDE, imc.ZUnits.HEIGHT
FLAVORS = st.sampled_from((PX4, ARDUPILOT))


def plan(*maneuvers, transitions=None, **fields):
    """A plan of maneuvers m0, m1 ..., or of PlanManeuvers."""
    items = [
        m if isinstance(m, imc.PlanManeuver) else imc.PlanManeuver(maneuver_id=f"m{i}", data=m)
        for i, m in enumerate(maneuvers)
    ]
    if transitions is None:
        transitions = [(f"m{i}", f"m{i + 1}", "") for i in range(len(items) - 1)]
    arrows = tuple(imc.PlanTransition(source_man=a, dest_man=b, conditions=c) for a, b, c in transitions)
    return imc.PlanSpecification(
        plan_id="test", start_man_id="m0", maneuvers=tuple(items), transitions=arrows, **fields
    )


def leg(north=0.0, east=0.0, z=2.0, **fields):
    """Fields of a maneuver on the grid of items."""
    place = {"lat": math.radians((X + 90 * round(north)) / 1e7), "lon": math.radians((Y + 119 * round(east)) / 1e7)}
    return {**place, "z": z, "z_units": DEPTH, "speed": 1.25, **fields}


def listed(specification, settings=SUBMARINE, flavor=PX4):
    """Commands and remarks of a plan."""
    found = items_of(specification, flavor, settings)
    return [MissionCommand(each.command).name for each in found.items], found.remarks


# What both can say

NORTH_EAST = st.integers(-300, 300)
RADII = st.floats(15, 200, width=32)
YAWS = st.sampled_from((NAN, 90.0, -45.5, 180.0, 359.0, 0.25))
SECONDS = st.integers(1, 9000)
ABOVE_BOTTOM = st.tuples(st.just(11), st.floats(1, 60, width=32))
DEPTHS = st.tuples(st.just(6), st.floats(-49, 0, width=32).map(lambda z: z + 0.0))  # not -0
HEIGHTS = st.tuples(st.just(6), st.integers(1, 12000).map(lambda cm: float32(cm / 100.0)))


def levels(craft):
    """Frames and altitudes in which plans of a vehicle are shown."""
    if craft.flies:
        return HEIGHTS | ABOVE_BOTTOM
    return DEPTHS | ABOVE_BOTTOM if craft.dives else st.just((6, 0.0))


@st.composite
def stays(draw, craft, speed):
    """An item that goes somewhere."""
    radius, unset = draw(RADII), (0, 0, 0, NAN)
    kinds = [
        (C.NAV_WAYPOINT, (0, 0, 0, draw(YAWS))),
        (C.NAV_LOITER_UNLIM, (0, 0, radius, NAN)),
        (C.NAV_LOITER_TIME, (draw(SECONDS), 0, radius, NAN)),
    ]
    if craft.keeps_station:
        turns = math.ceil(30 * speed / radius) + draw(st.integers(0, 4))
        kinds.append((C.NAV_WAYPOINT, (draw(SECONDS), radius, 0, draw(YAWS))))
        kinds.append((C.NAV_LOITER_TURNS, (turns, 0, draw(st.sampled_from((radius, -radius))), NAN)))
    if craft.dives:
        kinds.append((C.NAV_LOITER_TO_ALT, (0, radius)))
    command, numbers = draw(st.sampled_from(kinds))
    frame, z = draw(levels(craft))
    return item(command, draw(NORTH_EAST), draw(NORTH_EAST), z, *(numbers or unset), frame=frame)


@st.composite
def canonical(draw, craft):
    """A mission in the words in which plans are shown."""
    speed, items = craft.speed, []
    if craft.flies:
        frame, z = draw(levels(craft))
        items.append(item(C.NAV_TAKEOFF, 0, 0, z, 0, 0, 0, NAN, frame=frame))
    for _ in range(draw(st.integers(1, 4))):
        if craft.camera and draw(st.integers(0, 3)) == 0:
            items.append(bare(draw(st.sampled_from((C.IMAGE_START_CAPTURE, C.IMAGE_STOP_CAPTURE)))))
        if draw(st.integers(0, 3)) == 0 and (chosen := float32(draw(st.floats(0.125, 2.0)))) != speed:
            items.append(bare(C.DO_CHANGE_SPEED, 1, chosen, -1))
            speed = chosen
        items.append(draw(stays(craft, speed)))
    if (craft.flies or craft.dives) and draw(st.booleans()):
        items.append(item(C.NAV_LAND, 301, 301, 0, 0, 0, 0, NAN if craft.flies else 0))
    elif draw(st.booleans()):
        items.append(bare(C.NAV_RETURN_TO_LAUNCH))
    if craft.camera and draw(st.booleans()):
        items.append(bare(C.IMAGE_STOP_CAPTURE))
    return items


def for_ardupilot(items, craft):
    """The same with home first, and 0 for what is not given."""
    return [home_item(craft.home), *(i._replace(param4=0.0) if math.isnan(i.param4) else i for i in items)]


@pytest.mark.parametrize("vehicle", ["submarine", "boat", "copter", "plane"])
@settings(max_examples=40)
@given(st.data(), FLAVORS)
def test_missions_come_back_bit_by_bit(vehicle, data, flavor):
    craft = replace(VEHICLES[vehicle], speed=1.25)
    items = data.draw(canonical(craft))
    if first_item_seq(flavor):
        items = for_ardupilot(items, craft)
    made, table = plan_of(items, flavor, craft)
    again = items_of(made, flavor, craft)
    assert again.remarks == []
    assert packed(again.items) == packed(items)
    assert again.item_map == table
    assert plan_of(again.items, flavor, craft).plan == made


@settings(max_examples=100)
@given(st.data(), st.sampled_from(sorted(VEHICLES)), FLAVORS, FLAVORS)
def test_the_plan_of_any_mission_comes_back_the_same(data, vehicle, flavor, other):
    """Whatever a console wrote, another one gets a mission that flies the same plan."""
    craft = VEHICLES[vehicle]
    items = data.draw(usual_missions(craft))
    try:
        made, _ = plan_of(items, flavor, craft)
    except BadItem:
        return
    again = items_of(made, other, craft)
    assert again.remarks == []
    assert nameless(plan_of(again.items, other, craft).plan) == nameless(made)


# Plans of others


@pytest.mark.parametrize(
    ("maneuvers", "settings", "commands"),
    [
        ([imc.Goto(**leg(10))], SUBMARINE, ["NAV_WAYPOINT"]),
        ([imc.Goto(**leg(10), timeout=1000, roll=1.0, custom="a=b")], SUBMARINE, ["NAV_WAYPOINT"]),
        ([imc.StationKeeping(**leg(10), radius=20.0)], SUBMARINE, ["NAV_LOITER_UNLIM"]),
        ([imc.StationKeeping(**leg(10), radius=20.0, duration=9)], SUBMARINE, ["NAV_LOITER_TIME"]),
        ([imc.Goto(**leg(10)), imc.StationKeeping(**leg(10), radius=20.0, duration=9)], SUBMARINE, ["NAV_WAYPOINT"]),
        ([imc.Goto(**leg(10)), imc.StationKeeping(**leg(10, 1), radius=20.0, duration=9)], SUBMARINE,
         ["NAV_WAYPOINT", "NAV_LOITER_TIME"]),
        ([imc.Loiter(**leg(10), radius=20.0, duration=90)], SUBMARINE, ["NAV_LOITER_TURNS"]),
        ([imc.Loiter(**leg(10), radius=20.0, direction=2)], SUBMARINE, ["NAV_LOITER_UNLIM"]),
        ([imc.Elevator(lat=0.7, lon=-0.15, start_z=1.0, start_z_units=DEPTH, end_z=9.0, end_z_units=DEPTH, speed=1.25,
                       radius=12.0)], SUBMARINE, ["NAV_LOITER_TO_ALT"]),
        ([imc.Elevator(flags=1, start_z=1.0, start_z_units=DEPTH, end_z=9.0, end_z_units=DEPTH, speed=1.25,
                       radius=12.0)], SUBMARINE, ["NAV_LOITER_TO_ALT"]),
        ([imc.Goto(**leg(10)), imc.PopUp(**leg(10, z=0.0), flags=3, duration=1, radius=15.0)], SUBMARINE,
         ["NAV_WAYPOINT", "NAV_LAND"]),
        ([imc.Goto(**leg(10, speed=40.0, speed_units=2))], SUBMARINE, ["DO_CHANGE_SPEED", "NAV_WAYPOINT"]),
        ([imc.Goto(**leg(10, z=0.0, z_units=0))], BOAT, ["NAV_WAYPOINT"]),
        ([imc.IdleManeuver(duration=9), imc.Goto(**leg(10))], SUBMARINE, ["NAV_DELAY", "NAV_WAYPOINT"]),
    ],
)  # fmt: skip
def test_what_items_can_say_needs_no_remark(maneuvers, settings, commands):
    found, remarks = listed(plan(*maneuvers), replace(settings, speed=1.25))
    assert remarks == []
    assert found == commands


REFUSED = "the vehicle would not accept this mission"
BACK = "m1: the way back to m0 is not shown"
BESIDE, CONDITIONAL = "m2: is beside the way that is shown", "m0: the conditions of what follows are not shown"
ROWS = imc.Rows(**leg(), length=50.0, width=20.0, hstep=10.0, alternation=100, flags=2)
PATH = imc.FollowPath(**leg(), points=(imc.PathPoint(x=10.0), imc.PathPoint(x=10.0, y=10.0, z=1.0)))


@pytest.mark.parametrize(
    ("maneuvers", "count", "remark"),
    [
        ([PATH], 2, "m0: FollowPath is shown as 2 NAV_WAYPOINT"),
        ([ROWS], 7, "m0: Rows is shown as 7 NAV_WAYPOINT"),
        ([imc.YoYo(**leg(10), amplitude=1.0, pitch=0.2)], 1, "m0: YoYo is shown as 1 NAV_WAYPOINT"),
        ([imc.Launch(**leg(10))], 1, "m0: Launch is shown as 1 NAV_WAYPOINT"),
        ([imc.ScheduledGoto(lat=0.7, lon=0.1, z=2.0, z_units=1)], 1, "m0: ScheduledGoto is shown as 1 NAV_WAYPOINT"),
        ([imc.PopUp(**leg(10), duration=60)], 1, "m0: PopUp is shown as 1 NAV_LAND"),
        ([imc.PopUp(**leg(10), duration=60, flags=1)], 1, "m0: not shown as it is: z, duration, radius, flags"),
        ([imc.Loiter(**leg(10), radius=20.0)], 1, "m0: Loiter is shown as 1 NAV_LOITER_UNLIM"),
        ([imc.Loiter(**leg(10), radius=20.0, duration=60, type=3, length=40.0, direction=1)], 1,
         "m0: not shown as it is: type, length"),
        ([imc.Goto(**leg(10, speed=1000.0, speed_units=1))], 1, "m0: not shown as it is: speed, speed_units"),
        ([imc.Elevator(flags=1, start_z=7.0, start_z_units=1, end_z=9.0, end_z_units=1, speed=1.25, radius=12.0)], 1,
         "m0: not shown as it is: start_z"),
        ([imc.Goto(**leg(10)), imc.IdleManeuver(duration=9)], 2, "m1: IdleManeuver is shown as 1 NAV_DELAY"),
        ([imc.IdleManeuver()], 0, "m0: a wait without end is not shown"),
        ([imc.FollowPath(**leg())], 0, "m0: a path without points is not shown"),
        ([imc.Teleoperation()], 0, "m0: a Teleoperation is not shown"),
        ([imc.Goto(**leg(10, z=100.0))], 1,
         f"{REFUSED}: item 0 (NAV_WAYPOINT): depth 100 m is below the vehicle's limit of 49 m"),
        ([imc.Goto(lat=math.nan, speed=1.25)], 0, "m0: has no position, and is not shown"),
    ],
)  # fmt: skip
def test_remarks_say_what_items_cannot(maneuvers, count, remark):
    found = items_of(plan(*maneuvers), PX4, replace(SUBMARINE, speed=1.25))
    assert found.remarks == [remark]
    assert len(found.items) == count


def test_paths_and_rows_go_through_their_points():
    craft = replace(SUBMARINE, speed=1.25)
    items, _, table = items_of(plan(PATH, imc.Goto(**leg(50))), PX4, craft)
    lat, lon, _ = displace(PATH.lat, PATH.lon, 0.0, 10.0, 10.0)
    assert (items[1].x, items[1].y) == (round(math.degrees(lat) * 1e7), round(math.degrees(lon) * 1e7))
    assert [each.z for each in items] == [-2.0, -3.0, -2.0]
    assert (table.items_of("m0"), table.current_item("m0", 1), table.items_at_maneuver_end("m0")) == ((0, 1), 1, (0, 1))
    found = items_of(plan(ROWS.replace(width=10_000.0)), PX4, craft)
    assert len(found.items) == MOST_ITEMS
    assert f"only the first {MOST_ITEMS} items are shown" in found.remarks


def test_heights_are_shown_above_home():
    aloft = replace(COPTER, speed=1.25, aloft=True)
    height = plan(imc.Goto(**leg(10, z=GROUND + 20.0, z_units=HEIGHT)))
    items, remarks, _ = items_of(height, PX4, aloft)
    assert ([(each.frame, each.z) for each in items], remarks) == ([(6, 20.0)], [])
    assert items_of(height, PX4, replace(aloft, home=None)).remarks == [
        f"{REFUSED}: item 0 (NAV_WAYPOINT): home is not known yet, so altitudes mean nothing"
    ]


def test_cameras_are_shown_and_other_settings_are_not():
    def action(name, parameter, value):
        return imc.SetEntityParameters(name=name, params=(imc.EntityParameter(name=parameter, value=value),))

    on, off = (action("Fisheye Camera", "Save Images", value) for value in ("true", "false"))
    first = imc.PlanManeuver(maneuver_id="m0", data=imc.Goto(**leg(10)), start_actions=(on,))
    craft = replace(SUBMARINE, speed=1.25)
    assert listed(plan(first.replace(end_actions=(off,))), craft) == (
        ["IMAGE_START_CAPTURE", "NAV_WAYPOINT", "IMAGE_STOP_CAPTURE"], [],
    )  # fmt: skip
    other = first.replace(start_actions=(action("DVL", "Active", "true"),))
    assert listed(plan(other), craft) == (["NAV_WAYPOINT"], ["m0: not shown as it is: what is set as it begins"])
    assert listed(plan(first, start_actions=(on,)), craft)[1] == [
        "what the plan sets as it begins and ends is not shown"
    ]
    assert listed(plan(first), replace(craft, camera=""))[0] == ["NAV_WAYPOINT"]


@pytest.mark.parametrize(
    ("transitions", "commands", "remarks"),
    [
        ([("m0", "m1", "true"), ("m1", "m0", "")], 2, [BACK, BESIDE]),
        ([("m0", "m1", "FuelLevel.value < 20"), ("m0", "m2", "")], 2, [CONDITIONAL, BESIDE]),
        ([("m0", "m1", ""), ("m1", "_done_", ""), ("m2", "m1", "")], 2, [BESIDE]),
        ([("m0", "m2", ""), ("m2", "m1", " ManeuverIsDone ")], 3, []),
    ],
)  # fmt: skip
def test_branches_are_remarked(transitions, commands, remarks):
    branched = plan(*(imc.Goto(**leg(north)) for north in range(3)), transitions=transitions)
    found = items_of(branched, PX4, replace(SUBMARINE, speed=1.25))
    assert (len(found.items), found.remarks) == (commands, remarks)


def test_a_plan_without_a_start_is_no_item():
    found = items_of(plan(imc.Goto(**leg())).replace(start_man_id="x"), ARDUPILOT, SUBMARINE)
    assert found.remarks == ["the plan has no maneuver 'x' to begin with"]
    assert found.items == [home_item(SUBMARINE.home)]


def test_home_is_item_0_of_ardupilot():
    assert home_item(COPTER.home) == Item(0, 16, x=X, y=Y, z=30.0)
    assert home_item(None) == Item(0, 16)


NAMES = st.sampled_from(("m0", "m1", "m2", "m3", "_done_", ""))
MANEUVERS = [imc.builtin()[name] for name in sorted(imc.builtin().allowed_messages("Maneuver"))]
ANY = st.floats(width=32) | st.sampled_from((0.0, LAT, LON, 1.25, 2.0, 15.0))


@st.composite
def anything(draw):
    """A maneuver with any values in its fields."""
    kind = draw(st.sampled_from(MANEUVERS))
    fields = {}
    for info in imc.fields(kind):
        if info.type in ("fp32_t", "fp64_t"):
            fields[info.name] = draw(ANY)
        elif info.type in ("uint8_t", "uint16_t"):
            fields[info.name] = draw(st.integers(0, 255) | st.integers(0, 3))
        elif info.name == "points":
            fields[info.name] = tuple(draw(st.lists(st.builds(imc.PathPoint, x=ANY, y=ANY, z=ANY), max_size=3)))
    return kind(**fields)


@pytest.mark.heavy
@settings(max_examples=100)
@example([imc.FollowPoint(lat=LAT, lon=LON, max_speed=1.0)], None, "submarine", PX4)  # has a position, but no speed
@example([imc.RowsCoverage(angaperture=math.inf)], None, "submarine", PX4)
@given(
    st.lists(anything(), max_size=4),
    st.none() | st.lists(st.tuples(NAMES, NAMES, st.sampled_from(("", "no"))), max_size=4),
    st.sampled_from(sorted(VEHICLES)),
    FLAVORS,
)  # fmt: skip
def test_any_plan_is_listed(maneuvers, transitions, vehicle, flavor):
    """Nothing is raised, and what is not remarked comes back."""
    craft = VEHICLES[vehicle]
    items, remarks, table = items_of(plan(*maneuvers, transitions=transitions), flavor, craft)
    assert len(table.steps) == len(items)
    for each in items:
        assert max(2 * abs(each.x), abs(each.y)) <= 1_800_000_000
    if not remarks:
        again, _ = plan_of(items, flavor, craft)
        assert [type(m.data) for m in again.maneuvers] == [type(m) for m in maneuvers[: len(again.maneuvers)]]


def test_plane_circles_are_items():
    craft = replace(PLANE, speed=1.25, aloft=True)
    circle = imc.Loiter(**leg(10, z=50.0, z_units=ALTITUDE), radius=80.0, duration=60)
    assert listed(plan(circle), craft) == (["NAV_LOITER_TIME"], [])
