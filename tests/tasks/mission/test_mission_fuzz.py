"""Missions out of strategies, good and bad: what must hold for all of them, and what has once been wrong with some."""

import pytest
from flying import control, goto, plan_of, replies, start
from hypothesis import HealthCheck, given, settings
from missions import Happening, check, happen, happenings

import imc

Op = imc.PlanControl.Op
IDLE = plan_of(imc.IdleManeuver(duration=2))
SOME = settings(
    max_examples=40, derandomize=True, database=None, deadline=None, suppress_health_check=list(HealthCheck)
)


@SOME
@given(happenings())
def test_missions_of_an_ideal_vehicle(mission):
    run = happen(mission)
    check(mission, run)
    assert happen(mission).packets == run.packets


def test_a_start_that_another_replaces_at_once_is_answered():
    mission = Happening((start(IDLE, request_id=1), start(IDLE, request_id=2)))
    run = happen(mission)
    assert replies(run)[0] == ("FAILURE", "another plan is started")
    check(mission, run)


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
