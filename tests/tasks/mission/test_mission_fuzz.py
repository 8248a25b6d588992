"""Random good and bad missions keep all rules; and cases that failed once."""

import math

import pytest
from flying import CCU, OWN, control, goto, plan_of, replies, start
from hypothesis import HealthCheck, given, settings
from missions import Happening, check, happen, happenings
from sailing import Sailing, check_voyage, sail, sailings

import imc

Op = imc.PlanControl.Op
IDLE = plan_of(imc.IdleManeuver(duration=2))
DIVE = plan_of(goto(60, 0, 5.0), goto(60, 60, 5.0))
QUIET = {"derandomize": True, "database": None, "deadline": None, "suppress_health_check": list(HealthCheck)}


@pytest.mark.heavy
@settings(max_examples=15, **QUIET)
@given(happenings())
def test_missions_of_an_ideal_vehicle(mission):
    run = happen(mission)
    check(mission, run)
    assert happen(mission).packets == run.packets


@pytest.mark.heavy
@pytest.mark.computing
@settings(max_examples=4, **QUIET)
@given(sailings())
def test_missions_of_a_vehicle_with_dynamics(sailing):
    check_voyage(sailing, sail(sailing))


@pytest.mark.campaign
@settings(max_examples=40, **QUIET)
@given(sailings())
def test_many_missions_of_a_vehicle_with_dynamics(sailing):
    check_voyage(sailing, sail(sailing))


@pytest.mark.campaign
@settings(max_examples=100, **QUIET)
@given(happenings())
def test_many_missions_of_an_ideal_vehicle(mission):
    check(mission, happen(mission))


@pytest.mark.heavy
def test_equal_voyages_are_equal():
    sailing = Sailing(DIVE, "Simulators.DVL", 20.0, 0.3, -0.2, abort_at=30.0, until=40.0)
    assert sail(sailing).packets == sail(sailing).packets


@pytest.mark.heavy
def test_a_supervisor_that_restarts_stops_the_maneuver():
    sailing = Sailing(DIVE, "Supervisors.Vehicle", 30.0, abort_at=100.0)
    voyage = sail(sailing)
    check_voyage(sailing, voyage)
    assert voyage.replies[-1] == "vehicle is in BOOT mode"
    assert {mode for time, mode in voyage.modes if 35.0 < time < 100.0} == {imc.VehicleState.OpMode.SERVICE}
    assert next(depth for time, depth in voyage.depths if time > 90.0) < 0.5


@pytest.mark.heavy
def test_a_vehicle_that_loses_its_attitude_comes_up():
    sailing = Sailing(DIVE, "Simulators.IMU/AHRS", 40.0)
    check_voyage(sailing, sail(sailing))


def test_a_start_that_another_replaces_at_once_is_answered():
    mission = Happening((start(IDLE, request_id=1), start(IDLE, request_id=2)))
    run = happen(mission)
    assert {m.request_id for m in run.of(imc.PlanControl) if m.dst == CCU} >= {1, 2}
    check(mission, run)


def test_a_copy_of_a_request_that_is_not_answered_yet_gets_no_reply_of_its_own():
    load = control(Op.LOAD, 3.0, request_id=1, arg=IDLE)
    run = happen(mission := Happening((load, load)))
    check(mission, run)
    assert [m.info for m in run.of(imc.PlanControl) if m.dst == CCU and m.op == Op.LOAD] == ["plan loaded"]


def test_a_start_that_is_stopped_at_once_is_answered():
    mission = Happening((start(IDLE, request_id=1), control(Op.STOP, 2.0, request_id=2)))
    run = happen(mission)
    assert replies(run)[:2] == [("FAILURE", "plan was stopped"), ("SUCCESS", "OK")]
    check(mission, run)


def test_a_start_that_comes_twice_at_once_is_one():
    mission = Happening((start(IDLE), start(IDLE)))
    run = happen(mission)
    assert [info for _, info in replies(run)][:3] == ["plan loaded", "m0: executing maneuver", "plan completed"]
    check(mission, run)


@pytest.mark.parametrize("field", ["speed_units", "z_units"])
def test_units_that_nobody_knows_are_refused(field):
    mission = Happening((start(plan_of(goto(10, 0).replace(**{field: 9}))),))
    run = happen(mission)
    assert replies(run)[0] == ("FAILURE", f"m0: {field} 9 is not known")
    check(mission, run)


def test_a_transition_from_the_end_is_refused():
    mission = Happening((start(plan_of(goto(10, 0), transitions=[("_done_", "_done_", "")])),))
    run = happen(mission)
    assert replies(run)[0] == ("FAILURE", "invalid maneuver id '_done_'")
    check(mission, run)


def test_the_engine_does_not_take_answers_that_are_for_others():
    foreign = imc.VehicleCommand(timestamp=3.0, src=CCU, dst=OWN, request_id=2)
    mission = Happening((start(IDLE, flags=imc.PlanControl.Flags.CALIBRATE), foreign))
    run = happen(mission)
    assert [info for _, info in replies(run)][:3] == ["plan loaded", "m0: executing maneuver", "plan completed"]
    check(mission, run)


@pytest.mark.parametrize("kind", [imc.Goto, imc.StationKeeping, imc.Loiter])
def test_a_command_to_go_nowhere_is_an_error_of_the_maneuver(kind):
    nowhere = imc.VehicleCommand(timestamp=3.0, src=CCU, dst=OWN, maneuver=kind(lat=math.inf, speed=1.0))
    mission = Happening((nowhere,))
    run = happen(mission)
    failed = imc.ManeuverControlState.State.ERROR
    assert [m.info for m in run.of(imc.ManeuverControlState) if m.state == failed] == ["lat is not a number"]
    check(mission, run)
