"""Plans that cannot be executed are refused with a reason, and leave nothing behind."""

import math
from itertools import pairwise

import pytest
from flying import CCU, DEPTH, OWN, START, control, fly, goto, last, modes, phases, place, plan_of, replies, start

import imc
from tasks.plan.db import DB
from tasks.supervisors.vehicle import Vehicle

Op = imc.PlanControl.Op
GENERAL = {"Absolute Maximum Depth": "50", "Maximum Absolute Speed": "2", "Battery Capacity": "700"}
SETTINGS = {"General": {**GENERAL, "Recovery Plan": "dislodge"}}
SHORT = plan_of(goto(30, 0), goto(30, 30))
NO_WAY = "m1: maneuver has no incoming transition and it's not the initial maneuver"


def refusal(plan, **options):
    """The reply to a START with a plan that cannot be executed; checks that nothing remains of it."""
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
        (plan_of(goto(0, 0, depth=49.1)), "m0: maneuver depth beyond limits: 49.1 m, the vehicle goes down to 49 m"),
        (
            plan_of(imc.YoYo(z=45, z_units=DEPTH, amplitude=6, speed=1)),
            "m0: maneuver depth beyond limits: 51 m, the vehicle goes down to 49 m",
        ),
        (plan_of(goto(0, 0).replace(z=-1.0)), "m0: maneuver above the surface or below the bottom"),
        (
            plan_of(goto(0, 0).replace(z_units=imc.ZUnits.ALTITUDE, z=-3.0)),
            "m0: maneuver above the surface or below the bottom",
        ),
        (plan_of(goto(0, 0).replace(z_units=imc.ZUnits.NONE)), "m0: z is neither a depth nor an altitude"),
        (plan_of(goto(0, 0, speed=12.0)), "m0: a speed of 12 m/s is above the vehicle's 2 m/s"),
        (
            plan_of(imc.Elevator(end_z=60, end_z_units=DEPTH, speed=1)),
            "m0: maneuver depth beyond limits: 60 m, the vehicle goes down to 49 m",
        ),
        (plan_of(goto(0, 0), goto(1, 1), transitions=[]), NO_WAY),
        (plan_of(goto(0, 0)).replace(start_man_id="x"), "x: invalid start maneuver"),
        (plan_of(goto(0, 0)).replace(start_man_id=""), ": invalid start maneuver"),
        (plan_of(goto(0, 0), transitions=[("m0", "x", "")]), "invalid maneuver id 'x'"),
        (plan_of(goto(0, 0), transitions=[("x", "m0", "")]), "invalid maneuver id 'x'"),
        (plan_of(goto(0, 0), name=" "), "undefined plan id"),
        (plan_of(imc.Loiter(speed=1, radius=-5, z_units=DEPTH)), "m0: radius must not be below 0"),
        (plan_of(goto(0, 0).replace(speed=120.0, speed_units=2)), "m0: a speed of 120 % is above 100 %"),
        (
            plan_of(goto(0, 0), goto(1, 1), goto(2, 2), transitions=[("m1", "m2", ""), ("m2", "m1", "")]),
            "m1: maneuver cannot be reached from m0",
        ),
        (plan_of(goto(0, 0).replace(lat=math.nan)), "m0: lat is not a number"),
        (plan_of(goto(0, 0, depth=math.inf)), "m0: z is not a number"),
        (plan_of(goto(0, 0, speed=-math.inf)), "m0: speed is not a number"),
        (plan_of(goto(0, 0).replace(lon=math.nan)), "m0: lon is not a number"),
        (
            plan_of(imc.FollowPath(speed=1, points=(imc.PathPoint(x=math.nan),))),
            "m0: point 0 is not a position",
        ),
        (plan_of(goto(0, 0).replace(z_units=9)), "m0: z_units 9 is not known"),
        (plan_of(goto(0, 0).replace(lat=2.0)), "m0: lat 114.592° is out of range"),
        (plan_of(goto(0, 0).replace(lon=-4.0)), "m0: lon -229.183° is out of range"),
        (plan_of(goto(0, 0, speed=0.0)), "m0: speed must be above 0"),
        (plan_of(imc.FollowSystem(duration=60, z_units=DEPTH)), "m0: speed must be above 0"),
        (plan_of(goto(40_000, 0)), "m0: a leg of 40.0 km is longer than 25 km"),
        (plan_of(goto(20_000, 0), goto(-20_000, 0)), "m1: a leg of 40.0 km is longer than 25 km"),
        (plan_of(imc.Rows(speed=1, width=0, z_units=DEPTH)), "m0: width, length and step must be at least 1 mm"),
        (
            plan_of(goto(0, 0), transitions=[("m0", "m0", "x < 3")]),
            "m0: condition 'x < 3': 'x' is neither a number nor Message.field (known: abs, angle, hypot, max, min, "
            "sqrt, contains, distance), at character 1",
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


def test_a_plan_of_ten_thousand_maneuvers_is_no_message():
    with pytest.raises(imc.EncodeError):
        imc.encode(plan_of(*[imc.IdleManeuver(duration=1)] * 10_000))


BAD = {
    "START of a bad plan": (start(plan_of(None, name="bad"), 10.0, request_id=9), "m0: actual maneuver not specified"),
    "START of an unknown plan": (control(Op.START, 10.0, "nowhere", 9), "undefined plan"),
    "START of no plan": (control(Op.START, 10.0, "", 9), "undefined plan id"),
    "LOAD": (control(Op.LOAD, 10.0, "other", 9, arg=SHORT), "cannot load plan now"),
    "an unknown operation": (control(77, 10.0, "test", 9), "no such operation: 77"),
    "the recovery plan": (
        start(plan_of(goto(0, 0), name="dislodge"), 10.0, request_id=9),
        "only the plan generator may start the recovery plan",
    ),
}


@pytest.mark.parametrize("what", BAD)
def test_a_bad_request_leaves_a_running_plan_alone(what):
    request, reason = BAD[what]
    run = fly(start(SHORT), request, seconds=60, settings=SETTINGS)
    answers = {m.request_id: (imc.PlanControl.Type(m.type).name, m.info) for m in run.of(imc.PlanControl) if m.dst}
    assert answers[9] == ("FAILURE", reason)
    assert answers[7] == ("SUCCESS", "plan completed")
    assert last(run) == ("READY", "SUCCESS")


def test_requests_for_others_and_of_the_database_leave_a_running_plan_alone():
    ask = imc.PlanDB(src=CCU, plan_id="test", request_id=3)
    feed = [
        control(Op.STOP, 6.0, dst=0x1B),
        control(Op.STOP, 6.5, dst=0xFFFF),
        start(plan_of(None), 7.0, dst=0x1B),
        ask.replace(timestamp=8.0, op=imc.PlanDB.Op.DEL),
        ask.replace(timestamp=9.0, op=imc.PlanDB.Op.SET, arg=imc.PlanDBInformation(plan_id="test", md5=b"x" * 16)),
        ask.replace(timestamp=10.0, op=imc.PlanDB.Op.SET, arg=plan_of(None, name="another")),
        ask.replace(timestamp=11.0, op=imc.PlanDB.Op.CLEAR),
        imc.PlanDB(timestamp=12.0, src=CCU, type=imc.PlanDB.Type.SUCCESS, arg=plan_of(None)),
        imc.VehicleCommand(timestamp=13.0, src=CCU, dst=0x1B, command=imc.VehicleCommand.Command.STOP_MANEUVER),
        imc.Abort(timestamp=14.0, src=CCU, dst=0x1B),
    ]
    run = fly(start(SHORT), *feed, seconds=60, settings=SETTINGS)
    assert replies(run)[-1] == ("SUCCESS", "plan completed")
    infos = [m.info for m in run.of(imc.PlanDB) if m.dst == CCU and m.type == imc.PlanDB.Type.FAILURE]
    assert infos == ["no plan specification given", "plan id mismatch"]


def test_a_plan_replaces_another_that_never_ends():
    endless = plan_of(imc.Loiter(**place(40, 0), z=0, z_units=DEPTH, speed=1.5, radius=20, duration=0), name="endless")
    run = fly(start(endless), start(plan_of(None), 20.0, request_id=8), start(SHORT, 30.0, request_id=9), seconds=100)
    done = [m.request_id for m in run.of(imc.PlanControl) if m.info == "plan completed"]
    assert done == [9]
    assert modes(run)[-2:] == ["MANEUVER", "SERVICE"]


def test_a_plan_of_as_many_maneuvers_as_a_message_has_is_flown():
    names = [f"{number:x}" for number in range(2000)]
    plan = imc.PlanSpecification(
        plan_id="long",
        start_man_id=names[0],
        maneuvers=[imc.PlanManeuver(maneuver_id=name, data=imc.IdleManeuver(duration=60000)) for name in names],
        transitions=[imc.PlanTransition(source_man=a, dest_man=b) for a, b in pairwise(names)],
    )
    run = fly(start(plan), control(Op.GET, 4.0, ""), seconds=6)
    assert replies(run)[:2] == [("SUCCESS", "plan loaded"), ("SUCCESS", "0: executing maneuver")]
    assert len(run.of(imc.PlanStatistics)[0].durations) == pytest.approx(20_000, abs=30)


@pytest.mark.parametrize("size", [300, 30_000, 65_480])
def test_ids_of_any_length_are_answered(size):
    long, short = "x" * size, imc.PlanSpecification(plan_id="x" * min(size, 30_000))
    named = [imc.PlanManeuver(maneuver_id=short.plan_id, data=imc.IdleManeuver(duration=1))]
    many = short.replace(plan_id="p", start_man_id=short.plan_id, maneuvers=named)
    feed = [
        control(Op.START, 2.0, long),
        control(Op.START, 3.0, "p", arg=short),
        control(Op.START, 4.0, "p", arg=many),
        imc.PlanDB(timestamp=5.0, src=CCU, dst=OWN, op=imc.PlanDB.Op.GET, plan_id=long),
        imc.PlanGeneration(timestamp=6.0, src=CCU, dst=OWN, plan_id=long),
    ]
    run = fly(*feed, seconds=8)
    refused = f"{'x' * 20}...: an id is longer than 255 bytes"
    assert replies(run) == [("FAILURE", "undefined plan"), ("FAILURE", refused), ("FAILURE", refused)]
    (told,) = [m for m in run.of(imc.PlanDB) if m.dst == CCU]
    assert (told.type, told.plan_id) == (imc.PlanDB.Type.FAILURE, long[:1023])


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
    assert replies(run) == [("FAILURE", "only the plan generator may start the recovery plan")]
