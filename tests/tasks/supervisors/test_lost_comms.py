"""The plan that starts when a vehicle waits at the surface after a failed plan, and no console is in reach."""

import pytest
from flying import CCU, OWN, plan_of

import imc
from runtime.testing import START, simulate
from tasks.plan.db import DB
from tasks.supervisors.auv.lost_comms import LostComms
from tests.tasks.mission.stalling_clock import StallingClock

Control = imc.PlanControl
State = imc.PlanControlState
FAILED = State(timestamp=1.0, state=State.State.READY, last_outcome=State.LastOutcome.FAILURE)
SERVICE = imc.VehicleState(timestamp=1.0, op_mode=imc.VehicleState.OpMode.SERVICE)
AFLOAT = imc.VehicleMedium(timestamp=1.0, medium=imc.VehicleMedium.Medium.WATER)
WAITING = (FAILED, SERVICE, AFLOAT)
ABORT = imc.Abort(src=CCU, dst=OWN)


def store(at=0.5, name="lostcomms"):
    plan = plan_of(imc.IdleManeuver(duration=5), name=name)
    return imc.PlanDB(timestamp=at, src=CCU, dst=OWN, op=imc.PlanDB.Op.SET, plan_id=name, arg=plan)


def starts(*feed, seconds=60.0, settings=None, clock=None, **parameters):
    """Times (s) of its STARTs."""
    tasks = [(LostComms, {"lost_comms_timeout": 20.0, **parameters}), DB]
    run = simulate(tasks, sorted(feed, key=lambda m: m.timestamp), seconds=seconds, settings=settings, clock=clock)
    requests = [m for m in run.of(Control) if m.op == Control.Op.START and m.type == Control.Type.REQUEST]
    assert {(m.plan_id, m.dst, m.flags) for m in requests} <= {("lostcomms", OWN, Control.Flags.IGNORE_ERRORS)}
    return [round(m.timestamp - run.vehicle.start_time) for m in requests]


def test_it_starts_the_plan_after_the_timeout():
    assert starts(store(), *WAITING, seconds=40.0) == [22]


def test_a_plan_that_another_run_has_stored_counts():
    class Database(DB):
        def start(self):
            super().start()
            self._store.set(plan_of(imc.IdleManeuver(), name="lostcomms"), self._change(store()))

    run = simulate([(LostComms, {"lost_comms_timeout": 20.0}), Database], WAITING, seconds=40.0)
    assert [m.plan_id for m in run.of(Control) if m.op == Control.Op.START] == ["lostcomms"]


@pytest.mark.parametrize(
    "feed",
    [
        (WAITING),
        (store(name="other"), *WAITING),
        (store(), SERVICE, AFLOAT, FAILED.replace(last_outcome=State.LastOutcome.SUCCESS)),
        (store(), SERVICE, AFLOAT, FAILED.replace(state=State.State.EXECUTING)),
        (store(), FAILED, AFLOAT, SERVICE.replace(op_mode=imc.VehicleState.OpMode.MANEUVER)),
        (store(), FAILED, SERVICE, AFLOAT.replace(medium=imc.VehicleMedium.Medium.UNDERWATER)),
        (store(), FAILED, SERVICE, AFLOAT.replace(medium=imc.VehicleMedium.Medium.GROUND)),
        (store(), *WAITING, *(imc.Heartbeat(timestamp=float(t), src=CCU) for t in range(0, 60, 10))),
        (store(), *WAITING, ABORT.replace(timestamp=5.0)),
        (store(), *WAITING, imc.PlanDB(timestamp=5.0, src=CCU, dst=OWN, op=imc.PlanDB.Op.DEL, plan_id="lostcomms")),
        (store(), *WAITING, imc.PlanDB(timestamp=5.0, src=CCU, dst=OWN, op=imc.PlanDB.Op.CLEAR)),
    ],
    ids=[
        *("no plan", "other plan", "success", "executing", "maneuver", "under water", "on deck", "console"),
        *("abort", "deleted", "cleared"),
    ],
)
def test_it_does_nothing(feed):
    assert starts(*feed) == []


@pytest.mark.parametrize(("beats", "times"), [(True, []), (False, [72])])
def test_a_process_that_stands_still_does_not_lose_its_console(beats, times):
    """For 50 s, in which Heartbeat could not be received; without a console the time of 20 s goes on afterwards."""
    received = [imc.Heartbeat(timestamp=float(t), src=CCU) for t in (*range(10), *range(61, 90))] if beats else []
    clock = StallingClock(round(START * 1e9), [(10.05, 50.0)])
    assert starts(store(), *WAITING, *received, seconds=90.0, clock=clock) == pytest.approx(times, abs=1)


@pytest.mark.parametrize(("listed", "times"), [("", []), ("0x4101", [22]), ("0x4999, 0x4101", [])])
def test_a_stranger_that_may_not_command_is_no_console_in_reach(listed, times):
    beats = [imc.Heartbeat(timestamp=float(t), src=0x4999) for t in range(0, 60, 10)]
    assert starts(store(), *WAITING, *beats, seconds=40.0, settings={"General": {"Consoles": listed}}) == times


def test_a_heartbeat_of_another_vehicle_is_no_console():
    assert starts(store(), *WAITING, *(imc.Heartbeat(timestamp=float(t), src=0x0801) for t in range(30)))


def test_a_wave_over_the_vehicle_does_not_begin_the_time_again():
    wave = AFLOAT.replace(timestamp=10.0, medium=imc.VehicleMedium.Medium.UNDERWATER)
    assert starts(store(), *WAITING, wave, AFLOAT.replace(timestamp=12.0), seconds=30.0) == [22]


def test_after_an_abort_the_plan_must_be_stored_again():
    assert starts(store(), *WAITING, ABORT.replace(timestamp=5.0), store(at=15.0), seconds=45.0) == [36]


def test_a_start_that_is_refused_is_repeated_after_the_timeout_only():
    words = {"plan_id": "lostcomms", "dst": OWN, "dst_ent": 1, "info": "no fuel"}
    refusal = Control(timestamp=22.5, type=Control.Type.FAILURE, op=Control.Op.START, **words)
    assert starts(store(), *WAITING, refusal, FAILED.replace(timestamp=22.6), seconds=60.0) == [22, 44]
