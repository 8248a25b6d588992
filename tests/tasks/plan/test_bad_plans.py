"""Plans that cannot be executed: each has its reason, and nothing of it remains."""

import math

import pytest
from flying import DEPTH, START, control, fly, goto, last, modes, phases, plan_of, replies, start

import imc
from tasks.plan.db import DB
from tasks.supervisors.vehicle import Vehicle

Op = imc.PlanControl.Op
SETTINGS = {"General": {"Absolute Maximum Depth": "50", "Battery Capacity": "700", "Recovery Plan": "dislodge"}}
SHORT = plan_of(goto(30, 0), goto(30, 30))
NO_WAY = "m1: maneuver has no incoming transition and it's not the initial maneuver"


def refusal(plan, **options):
    """The reply to a START with a plan that cannot be executed; nothing of it must remain."""
    run = fly(start(plan), seconds=10, settings=SETTINGS, **options)
    assert last(run) == ("READY", "FAILURE")
    assert modes(run) == ["BOOT", "SERVICE"]
    ((kind, info),) = replies(run)
    assert kind == "FAILURE"
    return info


@pytest.mark.parametrize(
    ("plan", "reason"),
    [
        (imc.PlanSpecification(plan_id="test"), "test: no maneuvers"),
        (plan_of(None), "m0: actual maneuver not specified"),
        (plan_of(imc.FollowTrajectory()), "m0: maneuver is not supported"),
        (plan_of(imc.EstimatedState()), "m0: maneuver is not supported"),
        (plan_of(goto(0, 0, depth=50.1)), "m0: maneuver depth beyond limits"),
        (plan_of(imc.YoYo(z=45, z_units=DEPTH, amplitude=6, speed=1)), "m0: maneuver depth beyond limits"),
        (plan_of(imc.Elevator(end_z=60, end_z_units=DEPTH, speed=1)), "m0: maneuver depth beyond limits"),
        (plan_of(goto(0, 0), goto(1, 1), transitions=[]), NO_WAY),
        (plan_of(goto(0, 0)).replace(start_man_id="x"), "x: invalid start maneuver"),
        (plan_of(goto(0, 0)).replace(start_man_id=""), ": invalid start maneuver"),
        (plan_of(goto(0, 0), transitions=[("m0", "x", "")]), "invalid maneuver id 'x'"),
        (plan_of(goto(0, 0), transitions=[("x", "m0", "")]), "invalid maneuver id 'x'"),
        (plan_of(goto(0, 0).replace(lat=math.nan)), "m0: lat is not a number"),
        (plan_of(goto(0, 0, depth=math.inf)), "m0: z is not a number"),
        (plan_of(goto(0, 0).replace(lat=2.0)), "m0: lat 114.592° is out of range"),
        (plan_of(goto(0, 0).replace(lon=-4.0)), "m0: lon -229.183° is out of range"),
        (plan_of(goto(0, 0, speed=0.0)), "m0: speed must be above 0"),
        (plan_of(goto(40_000, 0)), "m0: a leg of 40.0 km is longer than 25 km"),
        (plan_of(goto(20_000, 0), goto(-20_000, 0)), "m1: a leg of 40.0 km is longer than 25 km"),
        (plan_of(imc.Rows(speed=1, width=0)), "m0: width, length and step must be at least 1 mm"),
        (
            plan_of(goto(0, 0), transitions=[("m0", "m0", "x < 3")]),
            "m0: condition 'x < 3': 'x' is not ManeuverIsDone and not Message.field",
        ),
        (plan_of(goto(0, 0)).replace(maneuvers=[imc.Goto()]), "test: Goto is not a PlanManeuver"),
        (plan_of(goto(0, 0)).replace(transitions=[imc.Goto()]), "test: Goto is not a PlanTransition"),
    ],
)
def test_plans_that_cannot_be_executed(plan, reason):
    assert refusal(plan) == reason


def test_two_maneuvers_with_one_name():
    plan = plan_of(goto(0, 0))
    assert refusal(plan.replace(maneuvers=plan.maneuvers * 2)) == "m0: maneuver id is used twice"


def test_a_plan_of_hundreds_of_maneuvers_is_executed():
    plan = plan_of(*[imc.IdleManeuver(duration=1)] * 900)
    run = fly(start(plan), seconds=30)
    assert phases(run)[-1] == ("EXECUTING", "m27")


def test_unknown_plans_and_no_plan_at_all():
    run = fly(control(Op.START, 2.0, "nowhere"), control(Op.START, 3.0, ""), control(9, 4.0), seconds=6)
    assert replies(run) == [
        ("FAILURE", "undefined plan"),
        ("FAILURE", "undefined plan id"),
        ("FAILURE", "no such operation: 9"),
    ]
    assert last(run) == ("READY", "FAILURE")


def test_a_failed_start_leaves_a_running_engine_able():
    run = fly(start(plan_of(None)), start(SHORT, 4.0), seconds=60)
    assert [text for _, text in replies(run)][-1] == "plan completed"


def test_without_a_database_the_engine_says_so():
    run = fly(control(Op.START, START), seconds=6, without=(DB,))
    assert replies(run) == [("FAILURE", "failed loading from DB: no answer")]


def test_without_a_supervisor_the_engine_does_not_hang():
    run = fly(start(SHORT, 1.0), seconds=10, without=(Vehicle,))
    assert replies(run)[-1][0] == "FAILURE"
    assert last(run) == ("BLOCKED", "FAILURE")
    later = fly(start(SHORT, 5.0), seconds=10, without=(Vehicle,))
    assert replies(later) == [("FAILURE", "cannot start a plan: vehicle mode is unknown")]


def test_the_recovery_plan_is_not_for_everybody():
    plan = plan_of(imc.Dislodge(rpm=1000), name="dislodge")
    run = fly(start(plan), seconds=5, settings=SETTINGS)
    assert replies(run) == [("FAILURE", "the recovery plan is started by the plan generator alone")]
