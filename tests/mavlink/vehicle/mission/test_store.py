"""A mission under way, without a socket: progress, pause, start, and plans of others."""

import math

import pytest

import imc
from tests.mavlink.vehicle.mission_console import ACCEPTED, Console, follow, read, waypoint


def test_progress(afloat):
    console, reached = Console(afloat), []
    afloat.endpoint.mission._reach = reached.extend
    console.upload([waypoint(0), waypoint(1, param1=5.0), waypoint(2)])
    phase, ended = imc.PlanControlState.State, imc.PlanControlState.LastOutcome
    names = [m.maneuver_id for m in afloat.endpoint.mission.plan.maneuvers]
    assert console.current()["mission_state"] == 2
    seen = []
    for name in names:
        follow(afloat, phase.EXECUTING, name)
        seen.append((console.current()["seq"], console.current()["mission_state"]))
    assert seen == [(0, 3), (1, 3), (1, 3), (2, 3)]
    assert reached == [0, 1]
    follow(afloat, phase.READY, outcome=ended.SUCCESS)
    assert reached == [0, 1, 2]
    assert console.current()["mission_state"] == 5
    follow(afloat, phase.READY, outcome=ended.SUCCESS)
    assert reached == [0, 1, 2]


def test_pause_and_continue(afloat):
    console = Console(afloat)
    console.upload([waypoint(0), waypoint(1), waypoint(2)])
    phase = imc.PlanControlState.State
    names = [m.maneuver_id for m in afloat.endpoint.mission.plan.maneuvers]
    afloat.endpoint.update_state(imc.VehicleState(op_mode=imc.VehicleState.OpMode.MANEUVER), "", afloat.now)
    follow(afloat, phase.EXECUTING, names[1])
    ack = console.say("COMMAND_LONG", command=193, param1=0)[0]
    assert ack.values["result"] == ACCEPTED
    assert len(afloat.holds) == 1
    follow(afloat, phase.EXECUTING, "1", plan="hold")
    assert console.current()["mission_state"] == 4
    assert console.say("COMMAND_LONG", command=193, param1=1)[0].values["result"] == ACCEPTED
    rest = afloat.requests[-1].arg
    assert (rest.start_man_id, len(rest.maneuvers)) == (names[1], 2)
    follow(afloat, phase.EXECUTING, names[1], plan=rest.plan_id)
    assert (console.current()["mission_state"], console.current()["seq"]) == (3, 1)
    assert console.say("COMMAND_LONG", command=224, param1=2)[0].values["result"] == ACCEPTED
    assert afloat.requests[-1].arg.start_man_id == names[2]
    assert console.say("COMMAND_LONG", command=224, param1=3)[0].values["result"] == 2


def test_start_needs_a_mission(afloat):
    console = Console(afloat)
    said = console.say("COMMAND_LONG", command=300)
    assert [m.values["result"] for m in said if m.name == "COMMAND_ACK"] == [4]
    assert read(said) == ["Cannot start the mission: no mission has been uploaded"]


def test_another_plan_that_the_vehicle_executes_becomes_the_mission(afloat):
    console = Console(afloat)
    console.upload([waypoint(0)])
    before = console.current()["mission_id"]
    steps = [imc.PlanManeuver(maneuver_id=n, data=imc.Goto(lat=0.7, lon=-0.15, z=3.0, z_units=1)) for n in "ab"]
    arrows = (imc.PlanTransition(source_man="a", dest_man="b", conditions="ManeuverIsDone"),)
    survey = imc.PlanSpecification(plan_id="survey", start_man_id="a", maneuvers=tuple(steps), transitions=arrows)
    afloat.plans["survey"] = survey
    follow(afloat, imc.PlanControlState.State.EXECUTING, "a", plan="survey")
    current = console.current()
    assert (current["total"], current["mission_id"] not in (0, before)) == (2, True)
    follow(afloat, imc.PlanControlState.State.EXECUTING, "b", plan="survey")
    assert (console.current()["seq"], console.current()["mission_state"]) == (1, 3)


@pytest.mark.parametrize("uploaded", ["on the ground", "in the air"])
@pytest.mark.parametrize("started", ["on the ground", "in the air"])
def test_whether_an_aircraft_takes_off_first_is_decided_when_the_mission_starts(open_desk, uploaded, started):
    desk = open_desk("px4", "copter")
    desk.locate(lat=math.radians(40.1), lon=math.radians(-8.6), height=55.0, depth=-1.0)
    console, medium = Console(desk), imc.VehicleMedium.Medium
    desk.endpoint.update_state(imc.ArmingState(state=imc.ArmingState.State.ARMED), "Autopilot", desk.now)

    def show(where):
        """Motors run on the ground as well, before a takeoff."""
        there = medium.AIR if where == "in the air" else medium.GROUND
        desk.endpoint.update_state(imc.VehicleMedium(medium=there), "Medium", desk.now)

    show(uploaded)
    assert console.upload([waypoint(0, z=20.0), waypoint(1, z=20.0)])[0]["type"] == ACCEPTED
    show(started)
    said = console.say("COMMAND_LONG", command=300)
    assert [m.values["result"] for m in said if m.name == "COMMAND_ACK"] == [ACCEPTED]
    begins = ["Goto0", "Goto1"] if started == "in the air" else ["Takeoff0", "Goto0", "Goto1"]
    plan = desk.requests[-1].arg
    assert [m.maneuver_id for m in plan.maneuvers] == begins
    assert plan.start_man_id == begins[0]
