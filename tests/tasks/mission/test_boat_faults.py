"""Boats in trouble: silent tasks, aborts, an empty battery, a stuck rudder, lost fixes."""

from functools import cache

import pytest

import imc
from shoal import fly
from tests.repeats import all_but
from tests.tasks.mission.boats import BOATS, KINDS, Mode, goto, plan_of, sail, sail_on
from tests.tasks.mission.underway import underway

FAULT = 25.0  # s


@pytest.fixture(scope="module")
def at_fault():
    """A boat that goes ahead, at the time of the fault."""
    return cache(lambda boat: underway(boat, plan_of(goto(200, 0)), FAULT, kinds=KINDS))


@pytest.mark.heavy
@pytest.mark.parametrize("boat", all_but(["otter"], BOATS))
def test_an_abort_stops_the_motors(boat):
    async def abort(vehicle, script):
        await script.sleep(30.0)
        script.publish(imc.Abort(dst=vehicle.system))

    voyage = sail(boat, plan_of(goto(200, 0)), happen=abort, until=60.0)
    assert {m.value for m in voyage.of(imc.SetThrusterActuation, 30.5)} <= {0.0}
    assert voyage.modes == [Mode.BOOT, Mode.SERVICE, Mode.MANEUVER, Mode.ERROR, Mode.SERVICE]
    speeds = [m.u for m in voyage.of(imc.SimulatedState, 30.0)]
    assert speeds[0] > 1.3
    assert speeds[-1] < 0.6 * speeds[0]


@pytest.mark.heavy
@pytest.mark.parametrize("boat", all_but(["caravel"], BOATS))
def test_a_maneuver_that_is_commanded_after_the_end_of_its_plan_does_not_run_on(boat):
    async def command_late(vehicle, script):
        await script.sleep(30.0)
        script.publish(imc.PlanControl(op=imc.PlanControl.Op.STOP, dst=vehicle.system))
        await script.sleep(4.0)
        start = imc.VehicleCommand(command=imc.VehicleCommand.Command.EXEC_MANEUVER, maneuver=goto(400, 0))
        vehicle.task("Plan.Engine").publish(start)

    voyage = sail(boat, plan_of(goto(200, 0)), happen=command_late, until=60.0)
    assert any(m.value > 0.1 for m in voyage.of(imc.SetThrusterActuation, 35.0, 37.0))
    assert {m.value for m in voyage.of(imc.SetThrusterActuation, 39.0)} <= {0.0}
    assert voyage.modes == [Mode.BOOT, *[Mode.SERVICE, Mode.MANEUVER] * 2, Mode.SERVICE]


def silenced(task):
    """What happens to a voyage whose task falls silent after 25 s."""

    async def silence(vehicle, script):
        await script.sleep(FAULT)
        vehicle.task(task).cancel_callbacks()

    return silence


@pytest.mark.parametrize(
    ("boat", "task", "within"),
    [
        ("otter", "Simulators.GPS", 12.0),
        ("caravel", "Simulators.GPS", 12.0),
        ("otter", "Simulators.IMU/AHRS", 5.0),
        ("otter", "Navigation.General.GPSNavigation", 8.0),
        ("otter", "Control.ASV.HeadingAndSpeed", 7.0),
        ("otter", "Simulators.Motor/Port", 5.0),
        ("caravel", "Simulators.Motor", 5.0),
        ("caravel", "Simulators.Servos", 5.0),
        ("caravel", "Control.ASV.Conventional.Heading", 5.0),
        ("caravel", "Control.ASV.Conventional.Speed", 6.0),
        ("otter", "Control.Path.VectorField", 5.0),
        ("caravel", "Control.Path.VectorField", 5.0),
        ("otter", "Plan.Engine", 5.0),
        ("otter", "Monitors.Entities", 5.0),
        ("otter", "Supervisors.Failsafe", 7.0),
    ],
)
def test_what_falls_silent_ends_the_plan_and_leaves_the_motors_at_rest(boat, task, within, at_fault):
    voyage = sail_on(at_fault(boat), (FAULT, lambda v: v.task(task).cancel_callbacks()), until=30.0 + within)
    assert voyage.modes[:4] == [Mode.BOOT, Mode.SERVICE, Mode.MANEUVER, Mode.ERROR]
    assert voyage.since(Mode.ERROR) < 25.0 + within
    last = {m.id: m.value for m in voyage.of(imc.SetThrusterActuation, 0.0, 29.0 + within)}
    assert set(last.values()) == {0.0}


@pytest.mark.heavy
@pytest.mark.parametrize("boat", all_but(["otter"], BOATS))
def test_the_motors_stop_without_supervisor_and_failsafe(boat):
    async def silence(vehicle, script):
        vehicle.task("Supervisors.Failsafe").cancel_callbacks()
        await silenced("Supervisors.Vehicle")(vehicle, script)

    voyage = sail(boat, plan_of(goto(200, 0)), happen=silence, until=35.0)
    assert max(abs(m.value) for m in voyage.of(imc.SetThrusterActuation, 25.0, 26.0)) > 0.1
    assert {m.value for m in voyage.of(imc.SetThrusterActuation, 30.0)} <= {0.0}


@pytest.mark.parametrize("boat", BOATS)
@pytest.mark.parametrize(("task", "to"), [("Supervisors.Vehicle", 0xFFFF), ("Maneuver.Goto", 0xFFF0)])
def test_the_motors_stop_without_supervisor_or_maneuver_and_an_abort_stops_them_at_once(boat, task, to, at_fault):
    silence = FAULT, lambda vehicle: vehicle.task(task).cancel_callbacks()
    voyage = sail_on(at_fault(boat), silence, until=32.0)
    assert {m.value for m in voyage.of(imc.SetThrusterActuation, 29.5)} <= {0.0}
    abort = FAULT + 1.0, lambda vehicle: vehicle.daemon.publish(imc.Abort(dst=to))
    stopped = sail_on(at_fault(boat), silence, abort, until=28.0)
    assert {m.value for m in stopped.of(imc.SetThrusterActuation, 26.1)} <= {0.0}


@pytest.mark.heavy
@pytest.mark.parametrize("boat", all_but(["caravel"], BOATS))
def test_a_boat_whose_battery_is_empty_drifts(boat):
    half_a_minute = {"otter": 0.07, "caravel": 0.03}[boat]  # % of the battery
    empty = f"Simulators.Battery:Initial Level={half_a_minute}", "Simulators.Battery:Error Level=0"
    voyage = sail(boat, plan_of(goto(200, 0)), *empty, until=90.0)
    assert max(m.u for m in voyage.of(imc.SimulatedState)) > 1.0
    assert voyage.of(imc.SimulatedState)[-1].u < 0.4
    assert Mode.MANEUVER in voyage.modes[:-1]


@pytest.mark.parametrize("boat", BOATS)
@pytest.mark.parametrize("level", ["Monitors.FuelLevel:Initial Level=9.5", "Simulators.Battery:Initial Level=5"])
def test_a_boat_does_not_leave_with_the_reserve_of_its_battery(boat, level):
    report = fly(plan_of(goto(200, 0)), boat, limit=60, overrides=[level])
    assert (report.outcome, report.reason) == ("FAILURE", "the battery is below its reserve of 10 %")


def test_a_rudder_that_is_stuck_ends_the_plan():
    faults = ("Simulators.Servos:Generate Faults=true", "Simulators.Servos:Fault Time=25")
    voyage = sail("caravel", plan_of(goto(200, 0)), *faults, until=40.0)
    assert voyage.modes == [Mode.BOOT, Mode.SERVICE, Mode.MANEUVER, Mode.ERROR]
    assert voyage.since(Mode.ERROR) < 27.0


def test_fixes_that_are_no_longer_valid_end_the_plan_and_the_boat_is_ready_when_they_are_back():
    async def jam(vehicle, script):
        gps = vehicle.task("Simulators.GPS")
        await script.sleep(25.0)
        gps.activation_depth = -1.0
        await script.sleep(20.0)
        gps.activation_depth = 0.2

    voyage = sail("otter", plan_of(goto(200, 0)), happen=jam, until=60.0)
    assert voyage.modes == [Mode.BOOT, Mode.SERVICE, Mode.MANEUVER, Mode.ERROR, Mode.SERVICE]
    assert 33.0 < voyage.since(Mode.ERROR) < 38.0
