"""Replies of the plan engine to good and bad requests."""

import pytest
from flying import BROADCAST, CCU, OWN, START, control, fly, goto, last, modes, phases, plan_of, replies, start

import imc
from runtime import Task
from tasks.maneuver import Maneuver
from tasks.monitors.entities import Entities

Op = imc.PlanControl.Op
Outcome = imc.PlanControlState.LastOutcome
SETTINGS = {"General": {"Absolute Maximum Depth": "50", "Battery Capacity": "700", "Recovery Plan": "dislodge"}}
SHORT = plan_of(goto(30, 0), goto(30, 30))


def test_a_plan_of_the_database():
    put = imc.PlanDB(timestamp=1.0, src=CCU, dst=OWN, op=imc.PlanDB.Op.SET, plan_id="test", arg=SHORT)
    run = fly(put, control(Op.START, START), seconds=50)
    assert replies(run, Op.START)[-1] == ("SUCCESS", "plan completed")
    assert last(run) == ("READY", "SUCCESS")


def test_replies_go_to_who_asked():
    run = fly(start(SHORT, src_ent=9, request_id=4711), seconds=10)
    answers = [m for m in run.of(imc.PlanControl) if m.type != imc.PlanControl.Type.REQUEST]
    assert {(m.dst, m.dst_ent, m.request_id, m.op, m.plan_id) for m in answers} == {(CCU, 9, 4711, Op.START, "test")}
    assert isinstance(answers[0].arg, imc.PlanStatistics)


def test_a_single_maneuver_is_a_quick_plan():
    run = fly(control(Op.START, START, "quick", arg=imc.IdleManeuver(duration=3)), seconds=10)
    assert replies(run)[1:] == [("SUCCESS", "IdleManeuver: executing maneuver"), ("SUCCESS", "plan completed")]


def test_calibration_comes_first_where_it_is_asked_for():
    run = fly(start(SHORT, flags=imc.PlanControl.Flags.CALIBRATE), seconds=60)
    assert modes(run) == ["BOOT", "SERVICE", "CALIBRATION", "MANEUVER", "SERVICE"]
    (calibration,) = run.of(imc.Calibration)
    assert calibration.duration == 3
    assert replies(run) == [
        ("SUCCESS", "plan loaded"),
        ("SUCCESS", "m0: executing maneuver"),
        ("SUCCESS", "plan completed"),
    ]


def test_stop_while_executing_and_while_calibrating():
    for flags in (0, imc.PlanControl.Flags.CALIBRATE):
        run = fly(start(SHORT, flags=flags), control(Op.STOP, 4.0, "", request_id=8), seconds=10)
        assert replies(run, Op.STOP) == [("SUCCESS", "OK")]
        assert last(run) == ("READY", "FAILURE")
        assert modes(run)[-1] == "SERVICE"
        assert ("SUCCESS", "plan completed") not in replies(run)
        (stopped,) = [m for m in run.of(imc.PlanControl) if m.op == Op.STOP]
        assert (stopped.plan_id, stopped.request_id) == ("test", 8)


def test_stop_while_idle():
    run = fly(control(Op.STOP, START), seconds=5)
    assert replies(run) == [("FAILURE", "no plan is running, request ignored")]
    assert last(run) == ("READY", "NONE")


def test_get_and_load():
    load = control(Op.LOAD, 3.0, arg=SHORT)
    run = fly(load, start(SHORT, 4.0), control(Op.GET, 6.0, ""), control(Op.LOAD, 7.0, arg=SHORT), seconds=60)
    (loaded,) = [m for m in run.of(imc.PlanControl) if m.op == Op.LOAD and m.type == imc.PlanControl.Type.SUCCESS]
    assert loaded.info == "plan loaded"
    assert loaded.arg.durations.startswith("Total=")
    assert replies(run, Op.LOAD)[-1] == ("FAILURE", "cannot load plan now")
    (got,) = [m for m in run.of(imc.PlanControl) if m.op == Op.GET]
    assert (got.type, got.plan_id) == (imc.PlanControl.Type.SUCCESS, "test")
    assert imc.encode(got.arg.replace(timestamp=-1.0)) == imc.encode(SHORT.replace(timestamp=-1.0))
    assert replies(run, Op.START)[-1] == ("SUCCESS", "plan completed")
    assert last(run) == ("READY", "SUCCESS")


def test_get_without_a_plan():
    assert replies(fly(control(Op.GET, START), seconds=5)) == [("FAILURE", "no plan is running")]


def test_start_while_running_replaces_the_plan():
    other = plan_of(goto(0, 30), name="other")
    run = fly(start(SHORT), start(other, 8.0, request_id=9), seconds=40)
    assert [m.plan_id for m in run.of(imc.PlanControl) if m.info == "plan completed"] == ["other"]
    outcomes = [(s.plan_id, s.last_outcome) for s in run.of(imc.PlanControlState)]
    assert ("other", Outcome.FAILURE) in outcomes
    assert last(run) == ("READY", "SUCCESS")
    kinds = {entry.text: entry.type for entry in run.of(imc.LogBookEntry)}
    assert kinds["replaced by another plan"] == imc.LogBookEntry.Type.INFO
    assert imc.LogBookEntry.Type.ERROR not in kinds.values(), "a console has meant it"


def test_a_stop_holds_for_the_plan_that_was_to_replace_another_too():
    other = plan_of(goto(0, 30), name="other")
    run = fly(start(SHORT), start(other, 8.0, request_id=9), control(Op.STOP, 8.0, "", request_id=10), seconds=40)
    answers = [(m.request_id, m.info) for m in run.of(imc.PlanControl) if m.request_id in (9, 10) and m.type]
    assert answers == [(10, "OK"), (9, "plan was stopped")]
    assert last(run) == ("READY", "FAILURE")


def test_the_same_request_twice_starts_once():
    run = fly(start(SHORT), start(SHORT, START + 0.5), seconds=60)
    assert replies(run).count(("SUCCESS", "m0: executing maneuver")) == 2
    assert len([m for m in run.of(imc.VehicleCommand) if m.type == 0 and m.maneuver is not None]) == 2
    assert replies(run)[-1] == ("SUCCESS", "plan completed")


def test_the_same_request_id_for_another_plan_is_another_request():
    run = fly(start(SHORT), start(plan_of(goto(0, 30), name="other"), START + 0.5), seconds=40)
    assert [m.plan_id for m in run.of(imc.PlanControl) if m.info == "plan completed"] == ["other"]


@pytest.mark.parametrize("dst", [0xFFFF, 0x001B, 0])
def test_requests_for_others_are_ignored(dst):
    run = fly(start(SHORT, dst=dst), control(Op.STOP, 3.0, dst=dst), seconds=6)
    assert replies(run) == []
    assert last(run) == ("READY", "NONE")


def test_requests_for_everybody_are_obeyed():
    assert replies(fly(start(SHORT, dst=BROADCAST), seconds=5))[0] == ("SUCCESS", "plan loaded")


def test_energy_is_compared_with_what_there_is():
    fuel = imc.FuelLevel(timestamp=1.0, value=11.0)
    settings = {
        "General": {
            **SETTINGS["General"],
            "Power Model -- Conversion - RPM": "0, 1000",
            "Power Model -- Conversion - Watt": "0, 40",
        }
    }
    far = plan_of(goto(10_000, 0))
    run = fly(fuel, start(far), seconds=5, settings=settings)
    ((kind, info),) = replies(run)
    assert (kind, info.endswith("the battery has 7 W h above its reserve")) == ("FAILURE", True)
    assert replies(fly(start(far), seconds=5, settings=settings))[0] == ("SUCCESS", "plan loaded")


def test_cycles_go_on_for_ever():
    plan = plan_of(goto(20, 0), goto(0, 0), transitions=[("m0", "m1", "true"), ("m1", "m0", "")])
    run = fly(start(plan), seconds=200)
    assert [man for _, man in phases(run)].count("m0") > 5
    statistics = run.of(imc.PlanStatistics)[0]
    assert statistics.properties == imc.PlanStatistics.Properties.CYCLICAL | imc.PlanStatistics.Properties.INFINITE
    assert {m.plan_eta for m in run.of(imc.PlanControlState) if m.man_id} == {-1}


def test_conditions_choose_the_way():
    fuel = [imc.FuelLevel(timestamp=float(t), value=50.0 - t) for t in range(1, 60, 2)]
    arrows = [
        ("m0", "m2", "ManeuverIsDone and FuelLevel.value < 40"),
        ("m0", "m1", ""),
        ("m1", "m0", ""),
        ("m2", "_done_", ""),
    ]
    plan = plan_of(goto(20, 0), goto(0, 0), imc.IdleManeuver(duration=1), transitions=arrows)
    run = fly(*fuel, start(plan), seconds=60)
    assert [man for _, man in phases(run) if man] == ["m0", "m1", "m0", "m2"]
    assert last(run) == ("READY", "SUCCESS")


def test_a_condition_may_end_a_maneuver_early():
    arrows = [("m0", "m1", "Temperature.value > 20")]
    plan = plan_of(
        imc.Loiter(lat=goto(0, 0).lat, lon=goto(0, 0).lon, speed=1, radius=15),
        imc.IdleManeuver(duration=1),
        transitions=arrows,
    )
    run = fly(imc.Temperature(timestamp=15.0, value=21.0), start(plan), seconds=30)
    assert last(run) == ("READY", "SUCCESS")
    (entered,) = [m.timestamp for m in run.of(imc.IdleManeuver) if m.duration == 1]
    assert entered - run.vehicle.start_time == pytest.approx(15.0, abs=1.0)


def test_a_plan_whose_conditions_lead_nowhere_fails():
    plan = plan_of(imc.IdleManeuver(duration=1), goto(0, 0), transitions=[("m0", "m1", "Temperature.value > 20")])
    run = fly(start(plan), seconds=10)
    assert replies(run)[-1] == ("FAILURE", "m0: done, but no condition of a transition holds")
    assert modes(run)[-1] == "SERVICE"


class Weak(Maneuver):
    """A custom maneuver that fails."""

    loops = 0

    async def execute(self, custom: imc.CustomManeuver) -> None:
        await self.sleep(2.0)
        raise RuntimeError("it is too hard")


def test_one_class_is_a_maneuver():
    plan = plan_of(imc.CustomManeuver(name="Weak"))
    run = fly(start(plan), seconds=10, more=(Weak,), keep_going=True)
    assert replies(run)[-1] == ("FAILURE", "CustomManeuver maneuver error: it is too hard")
    assert last(run) == ("READY", "FAILURE")


def test_a_maneuver_that_nobody_executes_ends_the_plan():
    run = fly(start(plan_of(imc.CustomManeuver(name="Other"))), seconds=10, more=(Weak,))
    assert replies(run)[-1] == ("FAILURE", "CustomManeuver maneuver error: no task executes it")
    assert modes(run)[-1] == "SERVICE"


def test_an_abort_ends_the_plan_and_the_engine_recovers():
    run = fly(start(SHORT), imc.Abort(timestamp=6.0, src=CCU, dst=OWN), start(SHORT, 10.0, request_id=8), seconds=60)
    assert ("FAILURE", "got abort request from system 0x4000 - 16384 @ 255") in replies(run)
    assert [state for state, _ in phases(run)][:8] == [
        "READY",
        "BLOCKED",
        "READY",
        "INITIALIZING",
        "EXECUTING",
        "BLOCKED",
        "READY",
        "INITIALIZING",
    ]
    assert len(run.of(imc.Aborted)) == 1
    assert replies(run)[-1] == ("SUCCESS", "plan completed")


def test_an_error_of_a_monitored_entity_ends_the_plan():
    class Sick(Task):
        """Fails after a while."""

        def start(self) -> None:
            self.set_entity_state(imc.EntityState.State.NORMAL, "active")
            self.after(8.0, self.set_entity_state, imc.EntityState.State.ERROR, "broken")

    options = {"seconds": 20, "without": (Entities,), "more": (Sick, (Entities, {"default_monitoring": ["Sick"]}))}
    run = fly(start(SHORT), **options)
    assert replies(run)[-1] == ("FAILURE", "vehicle errors: Sick")
    assert modes(run)[-1] == "ERROR"
    assert last(run) == ("BLOCKED", "FAILURE")
    careless = start(SHORT, flags=imc.PlanControl.Flags.IGNORE_ERRORS)
    run = fly(careless, **{**options, "seconds": 60})
    assert ("SUCCESS", "plan completed") in replies(run)
    assert modes(run)[-1] == "ERROR"
    refused = careless.replace(timestamp=careless.timestamp + 3.0, arg=plan_of(None), request_id=8)
    assert modes(fly(start(SHORT), refused, **options))[-1] == "ERROR"
