"""Missions become plans that say the same."""

import math
from dataclasses import replace
from itertools import pairwise

import pytest
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
    TERRAIN,
    VEHICLES,
    X,
    Y,
    bare,
    float32,
    item,
    maneuvers,
    on_wire,
    waypoint,
    without_home,
)

import imc
from mavlink.missions import BadItem, Item, ItemMap, MissionCommand, plan_of
from mavlink.missions import MissionResult as R

C = MissionCommand
DEPTH, ALTITUDE, HEIGHT, NONE = imc.ZUnits.DEPTH, imc.ZUnits.ALTITUDE, imc.ZUnits.HEIGHT, imc.ZUnits.NONE


# Waypoints


def test_a_waypoint_is_a_goto():
    (goto,) = maneuvers([waypoint(10, 20, -3.5, 0, 0, 0, 90)]).values()
    wanted = imc.Goto(
        lat=math.radians((X + 900) / 1e7), lon=math.radians((Y + 2380) / 1e7), z=3.5, z_units=DEPTH,
        speed=float32(1.2), speed_units=imc.SpeedUnits.METERS_PS, yaw=math.pi / 2,
    )  # fmt: skip
    assert goto == on_wire(wanted)


def test_a_waypoint_with_a_hold_time_is_a_stay_as_well():
    plan, table = plan_of([waypoint(10, 0, -3, 12.3, 30), waypoint(20, 0, -3, 0.5, 1)], PX4, SUBMARINE)
    goto, stay, _, short = (m.data for m in plan.maneuvers)
    assert (type(goto), type(stay), type(short)) == (imc.Goto, imc.StationKeeping, imc.StationKeeping)
    assert (stay.lat, stay.lon, stay.z, stay.speed) == (goto.lat, goto.lon, goto.z, goto.speed)
    assert (stay.duration, stay.radius) == (13, 30.0)
    assert (short.duration, short.radius) == (1, 15.0)  # never the 0 that means forever
    assert table.steps == (("Goto0", "StationKeeping0"), ("Goto1", "StationKeeping1"))


def test_a_waypoint_without_a_position_changes_only_the_depth():
    first, second = maneuvers([waypoint(10, 0, -3), Item(6, 16, z=-7.0)]).values()
    assert (second.lat, second.lon, second.z) == (first.lat, first.lon, 7.0)


@pytest.mark.parametrize(
    ("settings", "frame", "z", "level"),
    [
        (SUBMARINE, 3, -4.0, (4.0, DEPTH)),
        (SUBMARINE, 6, 0.0, (0.0, DEPTH)),
        (SUBMARINE, 6, -0.0, (0.0, DEPTH)),
        (SUBMARINE, 0, -4.0, (4.0, DEPTH)),
        (SUBMARINE, 5, -49.0, (49.0, DEPTH)),
        (SUBMARINE, 10, 3.0, (3.0, ALTITUDE)),
        (SUBMARINE, 11, 3.0, (3.0, ALTITUDE)),
        (BOAT, 6, 0.0, (0.0, DEPTH)),
        (BOAT, 3, 50.0, (0.0, DEPTH)),  # what consoles send by default
        (replace(COPTER, aloft=True), 6, 20.0, (float32(GROUND + 20.0), HEIGHT)),
        (replace(COPTER, aloft=True), 0, 50.0, (float32(GROUND - 30.0 + 50.0), HEIGHT)),
        (replace(COPTER, aloft=True), 11, 20.0, (20.0, ALTITUDE)),
    ],
)
def test_altitudes_in_every_frame(settings, frame, z, level):
    (goto,) = maneuvers([waypoint(10, 0, z, frame=frame)], settings).values()
    assert (goto.z, goto.z_units) == level
    assert math.copysign(1.0, goto.z) == 1.0


def test_altitudes_above_ground_need_no_home():
    bottom = maneuvers([waypoint(10, 0, 3, frame=TERRAIN)], without_home(SUBMARINE))
    assert [m.z for m in bottom.values()] == [3.0]
    up = maneuvers([waypoint(10, 0, 20, frame=TERRAIN)], without_home(COPTER))
    assert [(m.z, m.z_units) for m in up.values()] == [(20.0, ALTITUDE)] * 2


# Stays and circles


@pytest.mark.parametrize(
    ("command", "numbers", "settings", "kind", "fields"),
    [
        (C.NAV_LOITER_UNLIM, (), SUBMARINE, imc.StationKeeping, {"duration": 0, "radius": 15.0}),
        (C.NAV_LOITER_UNLIM, (0, 0, 30), BOAT, imc.StationKeeping, {"duration": 0, "radius": 30.0}),
        (C.NAV_LOITER_UNLIM, (0, 0, -30), SUBMARINE, imc.Loiter, {"duration": 0, "radius": 30.0, "direction": 2}),
        (C.NAV_LOITER_UNLIM, (0, 0, -30), COPTER, imc.StationKeeping, {"radius": 30.0}),
        (C.NAV_LOITER_UNLIM, (0, 0, -80), PLANE, imc.Loiter, {"duration": 0, "radius": 80.0, "direction": 2}),
        (C.NAV_LOITER_TIME, (60,), SUBMARINE, imc.StationKeeping, {"duration": 60, "radius": 15.0}),
        (C.NAV_LOITER_TIME, (0,), SUBMARINE, imc.StationKeeping, {"duration": 1}),
        (C.NAV_LOITER_TIME, (60, 0, 80), PLANE, imc.Loiter, {"duration": 60, "radius": 80.0, "direction": 1}),
        (C.NAV_LOITER_TURNS, (3, 0, 20), SUBMARINE, imc.Loiter, {"duration": 314, "radius": 20.0, "direction": 1}),
        (C.NAV_LOITER_TURNS, (3, 0, -20), SUBMARINE, imc.Loiter, {"duration": 314, "type": 1, "direction": 2}),
        (C.NAV_LOITER_TURNS, (3, 0, 5), SUBMARINE, imc.Loiter, {"duration": 157, "radius": 5.0}),  # turns with 10 m
        (C.NAV_LOITER_TO_ALT, (0, 20), COPTER, imc.Goto, {}),
    ],
)
def test_stays_and_circles(command, numbers, settings, kind, fields):
    z = 20.0 if settings.flies else 0.0
    *_, made = maneuvers([item(command, 10, 0, z, *numbers)], settings).values()
    assert type(made) is kind
    assert {name: getattr(made, name) for name in fields} == fields


def test_turns_take_as_long_as_their_way_at_the_present_speed():
    slow = maneuvers([bare(C.DO_CHANGE_SPEED, 1, 0.5), item(C.NAV_LOITER_TURNS, 0, 0, 0, 2, 0, 30)])
    assert [m.duration for m in slow.values()] == [round(2 * math.tau * 30 / 0.5)]


def test_loitering_to_an_altitude_is_an_elevator():
    items = [waypoint(10, 0, -2), item(C.NAV_LOITER_TO_ALT, 20, 0, -8, 0, 25), item(C.NAV_LOITER_TO_ALT, 20, 0, -3)]
    _, down, up = maneuvers(items).values()
    assert (down.start_z, down.end_z, down.radius, down.flags) == (2.0, 8.0, 25.0, 0)
    assert (up.start_z, up.end_z, up.start_z_units, up.end_z_units) == (8.0, 3.0, DEPTH, DEPTH)
    (here,) = maneuvers([Item(11, int(C.NAV_LOITER_TO_ALT), z=4.0)]).values()
    assert (here.flags, here.start_z, here.end_z_units) == (imc.Elevator.Flags.CURR_POS, 1.0, ALTITUDE)


@pytest.mark.parametrize("command", [C.NAV_DELAY, C.CONDITION_DELAY])
def test_a_delay_is_a_stay_where_the_vehicle_is(command):
    goto, stay = maneuvers([waypoint(10, 0, -3), bare(command, 9)]).values()
    assert (stay.lat, stay.lon, stay.z, stay.duration) == (goto.lat, goto.lon, 3.0, 9)
    (idle,) = maneuvers([bare(command, 9)]).values()
    assert idle == imc.IdleManeuver(duration=9)
    first, *_ = maneuvers([bare(command, 9), item(C.NAV_TAKEOFF, 0, 0, 10)], COPTER).values()
    assert type(first) is imc.IdleManeuver


# Takeoff, landing, return


def test_a_copter_takes_off_and_lands():
    items = [item(C.NAV_TAKEOFF, 0, 0, 10, 15), waypoint(30, 0, 20), item(C.NAV_LAND, 40, 0, 0, 5, 0, 0, 90)]
    takeoff, _, land = maneuvers(items, COPTER).values()
    assert (takeoff.z, takeoff.z_units, takeoff.speed) == (float32(GROUND + 10), HEIGHT, 5.0)
    assert takeoff.takeoff_pitch == pytest.approx(math.radians(15))
    assert (land.lat, land.z, land.z_units) == (math.radians((X + 3600) / 1e7), float32(GROUND + 20), HEIGHT)
    assert (land.abort_z, land.bearing) == (5.0, math.pi / 2)
    *_, here = maneuvers([*items[:2], Item(6, int(C.NAV_LAND))], COPTER).values()
    assert (here.lat, here.lon, here.z_units) == (0.0, 0.0, NONE)


def test_a_copter_without_a_takeoff_takes_off_to_its_first_waypoint():
    plan, table = plan_of([waypoint(30, 0, 25), waypoint(40, 0, 30)], PX4, COPTER)
    assert table.steps == (("Takeoff0", "Goto0"), ("Goto1",))
    assert [m.data.z for m in plan.maneuvers] == [float32(GROUND + z) for z in (25, 25, 30)]
    low, *_ = maneuvers([waypoint(30, 0, 0)], COPTER).values()
    assert low.z == float32(GROUND + 10)  # the usual height
    assert list(maneuvers([waypoint(30, 0, 25)], replace(COPTER, aloft=True))) == ["Goto0"]


def test_a_submarine_lands_on_the_surface():
    plan, table = plan_of([waypoint(10, 0, -3), item(C.NAV_LAND, 20)], PX4, SUBMARINE)
    _, goto, popup = (m.data for m in plan.maneuvers)
    assert (goto.lat, goto.z) == (math.radians((X + 1800) / 1e7), 3.0)
    assert (popup.z, popup.z_units, popup.duration) == (0.0, DEPTH, 1)
    assert popup.flags == imc.PopUp.Flags.CURR_POS | imc.PopUp.Flags.WAIT_AT_SURFACE
    assert table.steps[1] == ("Goto1", "PopUp1")
    assert list(maneuvers([waypoint(10, 0, -3), Item(6, int(C.NAV_LAND))])) == ["Goto0", "PopUp1"]


@pytest.mark.parametrize(
    ("settings", "kinds"),
    [
        (SUBMARINE, [imc.Goto, imc.Goto, imc.PopUp]),
        (BOAT, [imc.Goto, imc.Goto]),
        (COPTER, [imc.Takeoff, imc.Goto, imc.Land]),
    ],
)
def test_a_return_goes_home(settings, kinds):
    made = list(
        maneuvers([waypoint(10, 0, 20 if settings.flies else 0), bare(C.NAV_RETURN_TO_LAUNCH)], settings).values()
    )
    assert [type(maneuver) for maneuver in made] == kinds
    assert (made[-1].lat, made[-1].lon) == (LAT, LON)


# Speed and camera


def test_a_speed_holds_until_the_next():
    items = [
        waypoint(10), bare(C.DO_CHANGE_SPEED, 1, 1.5, -1), waypoint(20), bare(C.DO_CHANGE_SPEED, 0, -1, 40),
        waypoint(30), bare(C.DO_CHANGE_SPEED, 1, -1, -1), waypoint(40), bare(C.DO_CHANGE_SPEED, 1, -2, NAN),
        waypoint(50),
    ]  # fmt: skip
    units = imc.SpeedUnits
    usual = (float32(1.2), units.METERS_PS)
    share = (40.0, units.PERCENTAGE)
    made = [(m.speed, m.speed_units) for m in maneuvers(items).values()]
    assert made == [usual, (1.5, units.METERS_PS), share, share, usual]


def test_the_camera_is_switched_where_the_mission_says_so():
    items = [
        waypoint(10), bare(C.IMAGE_START_CAPTURE, 0, 2, 0), waypoint(20), bare(C.IMAGE_STOP_CAPTURE),
        bare(C.DO_SET_CAM_TRIGG_DIST, 5), waypoint(30), bare(C.DO_SET_CAM_TRIGG_DIST, 0),
    ]  # fmt: skip
    plan, table = plan_of(items, PX4, SUBMARINE)

    def values(actions):
        return [(a.name, p.name, p.value) for a in actions for p in a.params]

    def switch(value):
        return ("Fisheye Camera", "Save Images", value)

    assert [values(m.start_actions) for m in plan.maneuvers] == [
        [], [switch("true")], [switch("false"), switch("true")],
    ]  # fmt: skip
    assert [values(m.end_actions) for m in plan.maneuvers] == [[], [], [switch("false")]]
    assert [table.commands_at_maneuver_start(name) for name in ("Goto0", "Goto2", "Goto5")] == [(), (1,), (3, 4)]
    assert [table.items_at_maneuver_end(name) for name in ("Goto0", "Goto2", "Goto5")] == [(0,), (2,), (5, 6)]


# Home, and the table


def test_item_0_of_ardupilot_is_home_and_not_flown():
    home = Item(0, 16, x=0, y=5, z=-7.0, param1=NAN)
    plan, table = plan_of([home, waypoint(10), waypoint(20)], ARDUPILOT, SUBMARINE)
    assert [m.maneuver_id for m in plan.maneuvers] == ["Goto1", "Goto2"]
    assert (table.steps, table.first) == (((), ("Goto1",), ("Goto2",)), 1)
    assert (
        table.commands_at_maneuver_start("Goto1"),
        table.items_at_maneuver_end("Goto1"),
        table.current_item("Goto2"),
    ) == ((), (1,), 2)
    assert table.renumbered(-1) == ItemMap((("Goto1",), ("Goto2",)))


@pytest.mark.parametrize(
    ("wrong", "result"),
    [
        ({"x": 2_000_000_000}, R.INVALID_PARAM5_X),
        ({"y": -1_900_000_000}, R.INVALID_PARAM6_Y),
        ({"z": NAN}, R.INVALID_PARAM7),
        ({"param1": math.inf}, R.INVALID_PARAM1),
        ({"frame": 77}, R.UNSUPPORTED_FRAME),
        ({"command": 9999}, R.UNSUPPORTED),
    ],
)
def test_an_item_0_that_no_home_can_have_is_refused(wrong, result):
    with pytest.raises(BadItem, match="item 0") as error:
        plan_of([Item(0, 16)._replace(**wrong), waypoint(10)], ARDUPILOT, SUBMARINE)
    assert error.value.result == result


def test_the_maneuvers_follow_each_other():
    plan, _ = plan_of([waypoint(north, 0, -1, 5) for north in range(3)], PX4, replace(SUBMARINE, name="dive"))
    names = [m.maneuver_id for m in plan.maneuvers]
    assert (plan.plan_id, plan.start_man_id) == ("dive", names[0])
    assert [(t.source_man, t.dest_man, t.conditions) for t in plan.transitions] == [
        (a, b, "ManeuverIsDone") for a, b in pairwise(names)
    ]
    assert on_wire(plan) == plan


def test_the_table_tells_progress():
    table = ItemMap((("Takeoff0", "Goto0"), (), ("Path2",), ("Path2",), ("Goto4",), ()))
    assert [table.current_item(name) for name in ("Takeoff0", "Goto0", "Path2", "Goto4", "x")] == [0, 0, 2, 4, None]
    assert [table.current_item("Path2", point) for point in (-1, 0, 1, 9)] == [2, 2, 3, 3]
    assert [table.commands_at_maneuver_start(name) for name in ("Takeoff0", "Goto0", "Path2", "x")] == [
        (),
        (),
        (1,),
        (),
    ]
    assert [table.items_at_maneuver_end(name) for name in ("Takeoff0", "Goto0", "Path2", "Goto4", "x")] == [
        (),
        (0,),
        (2, 3),
        (4, 5),
        (),
    ]
    assert [table.maneuver_at(seq) for seq in (0, 1, 4, 5)] == ["Takeoff0", "Path2", "Goto4", None]
    moved = table.renumbered(1)
    assert (moved.first, moved.current_item("Goto4"), moved.commands_at_maneuver_start("Takeoff0")) == (1, 5, ())
    assert moved.renumbered(-1) == table


def test_numbers_that_are_not_given_are_usual():
    """MAVSDK sends NaN where ArduPilot's consoles send 0."""
    for vehicle in VEHICLES.values():
        z = 20.0 if vehicle.flies else 0.0
        for command in (C.NAV_WAYPOINT, C.NAV_LOITER_UNLIM, C.NAV_SPLINE_WAYPOINT):
            unset = item(command, 1, 0, z, NAN, NAN, NAN, NAN)
            assert maneuvers([unset], vehicle) == maneuvers([item(command, 1, 0, z)], vehicle)
