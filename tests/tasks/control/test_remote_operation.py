"""Remote operation: each reference alone, and with the whole vehicle."""

import math
from pathlib import Path

import pytest
from lean import BLIND, UNLOGGED

import imc
from imc.tuple_list import parse_tuple_list, parse_tuple_list_integer
from runtime import State, Task
from runtime.testing import simulate
from shoal.missions import prepare
from tasks.control.auv.remote_operation import RemoteOperation

Loops = imc.CLoopsMask
OWN, CCU, STRANGER = 0x001A, 0x4001, 0x4002
DEPTH = imc.ZUnits.DEPTH


def enabled(time=0.5, on=1, mask=Loops.TELEOPERATION, scope=4):
    return imc.ControlLoops(timestamp=time, enable=on, mask=mask, scope_ref=scope)


def actions(time, text, src=CCU, **fields):
    return imc.RemoteActions(timestamp=time, src=src, actions=text, **fields)


def held(text, begin=1.0, end=5.0, **fields):
    """The messages that a console sends five times a second."""
    return [actions(begin + 0.2 * k, text, **fields) for k in range(round((end - begin) / 0.2))]


def steered(*feed, seconds=5.0, depth=3.0, located=None, **parameters):
    states = [imc.EstimatedState(timestamp=0.05 * k, depth=depth) for k in range(round((located or seconds) * 20))]
    feed = sorted([*states, *feed], key=lambda m: m.timestamp)
    return simulate(RemoteOperation, [enabled(), *feed], seconds=seconds, **parameters)


def last(run, kind):
    return run.of(kind)[-1].value


def test_axes_become_thrust_heading_rate_and_pitch():
    run = steered(*held("Heading=127;Thrust=63.5;Pitch=-127"))
    assert last(run, imc.DesiredSpeed) == pytest.approx(35.0)
    assert run.of(imc.DesiredSpeed)[-1].speed_units == imc.SpeedUnits.PERCENTAGE
    assert last(run, imc.DesiredHeadingRate) == pytest.approx(math.radians(40.0))
    assert last(run, imc.DesiredPitch) == pytest.approx(math.radians(-15.0))
    assert len(run.of(imc.DesiredSpeed)) == 44, "ten a second since the loop is enabled"


def test_axes_have_an_end():
    assert last(steered(*held("Thrust=900")), imc.DesiredSpeed) == pytest.approx(70.0)
    assert last(steered(*held("Heading=-900")), imc.DesiredHeadingRate) == pytest.approx(-math.radians(40.0))


def test_nothing_is_steered_without_the_loop():
    run = simulate(RemoteOperation, held("Thrust=127"), seconds=5.0)
    assert run.of(imc.DesiredSpeed) == []


def test_loops_below_are_enabled_in_the_scope_of_the_maneuver_and_left_with_it():
    run = steered(*held("Thrust=10;Pitch=20"), enabled(4.0, on=0), seconds=6.0)
    loops = [(m.enable, m.mask, m.scope_ref) for m in run.of(imc.ControlLoops)]
    steering = Loops.SPEED | Loops.YAW_RATE | Loops.PITCH
    assert loops[0] == (1, steering, 4)
    assert loops[-1] == (0, steering, 4)
    assert max(m.timestamp for m in run.of(imc.DesiredSpeed)) - run.vehicle.start_time <= 4.0
    assert run.task.entity.description == "idle"


def test_the_depth_is_kept_while_no_pitch_is_asked_for():
    run = steered(*held("Thrust=50;Pitch=30", end=3.0), *held("Thrust=50", begin=3.0), depth=3.0)
    assert (run.of(imc.DesiredZ)[-1].value, run.of(imc.DesiredZ)[-1].z_units) == (3.0, DEPTH)
    changes = [(m.enable, m.mask) for m in run.of(imc.ControlLoops)]
    assert changes[-2:] == [(0, Loops.PITCH), (1, Loops.DEPTH)]


def test_buttons_change_the_thrust_once_for_each_time_they_go_down():
    presses = [
        actions(1.0, "Accelerate=1"),
        actions(1.2, "Accelerate=1"),
        actions(1.4, ""),
        actions(1.6, "Accelerate=1"),
    ]
    assert last(steered(*presses, seconds=2.0), imc.DesiredSpeed) == pytest.approx(14.0)
    slower = [*presses, actions(1.8, "Decelerate=1")]
    assert last(steered(*slower, seconds=2.0), imc.DesiredSpeed) == pytest.approx(7.0)
    assert last(steered(*presses, actions(1.8, "Stop=1"), seconds=2.0), imc.DesiredSpeed) == 0.0


def test_thrust_can_be_left_to_the_buttons():
    run = steered(*held("Thrust=127"), buttons_only=True)
    assert last(run, imc.DesiredSpeed) == 0.0
    assert "Thrust" not in run.of(imc.RemoteActionsRequest)[0].actions


def test_a_silent_operator_ends_in_neutral_and_comes_back():
    run = steered(
        *held("Thrust=127;Heading=127;Pitch=127", end=3.0), *held("Thrust=64", begin=8.0, end=9.0), seconds=9.0
    )
    begin = run.vehicle.start_time
    speeds = [(m.timestamp - begin, m.value) for m in run.of(imc.DesiredSpeed)]
    neutral = [time for time, value in speeds if value == 0.0 and time > 3.0]
    assert 4.7 < neutral[0] < 5.0, "last heard at 2.8 s"
    assert all(m.value == 0.0 for m in run.of(imc.DesiredHeadingRate) if 5.0 < m.timestamp - begin < 8.0)
    assert all(m.value == 0.0 for m in run.of(imc.DesiredPitch) if 5.0 < m.timestamp - begin < 8.0)
    states = [(m.state, m.description) for m in run.of(imc.EntityState) if m.src_ent == run.task.entity.id]
    assert (State.FAULT, "no remote action for 2 s") in states
    assert run.task.entity.state is State.NORMAL
    assert speeds[-1][1] == pytest.approx(35.0, abs=0.5)
    assert run.log.count("no remote action for 2 s") == 1


def test_a_vehicle_that_does_not_know_its_attitude_is_left_neutral():
    run = steered(*held("Thrust=127", end=6.0), seconds=6.0, located=3.0)
    assert last(run, imc.DesiredSpeed) == 0.0
    assert run.task.entity.description == "no EstimatedState for 2 s"


def test_only_the_operator_who_began_it_steers():
    begun = imc.Teleoperation(timestamp=0.4, custom=f"src={CCU}")
    assert last(steered(begun, *held("Thrust=127", src=STRANGER)), imc.DesiredSpeed) == 0.0
    assert last(steered(begun, *held("Thrust=127", src=CCU)), imc.DesiredSpeed) == pytest.approx(70.0)
    other = held("Thrust=127", dst=OWN + 1)
    assert last(steered(*other), imc.DesiredSpeed) == 0.0


@pytest.mark.parametrize("text", ["", ";;", "=", "Thrust", "Thrust=", "Thrust=nan", "Thrust=1e999", "\udc80=\udcff"])
def test_nonsense_moves_nothing(text):
    assert last(steered(*held(text)), imc.DesiredSpeed) == 0.0


def test_nonsense_beside_sense_costs_itself_alone():
    run = steered(*held("Thrust=abc;Heading=127;Fly=1"))
    assert last(run, imc.DesiredHeadingRate) == pytest.approx(math.radians(40.0))
    assert "remote actions are not numbers: Thrust=abc" in run.log


class DelayedConsole(Task):
    """Commands of a console whose clock is an hour fast: five that come at once, and eight that come together later.

    Before these, others send something.
    """

    others = 0

    def start(self):
        for number in range(self.others):
            aside = imc.encode_with_header(imc.RemoteActions(), self.now, CCU + 1 + number, 3, OWN, 0xFF)
            self.after(5.9, self.relay, aside)
        quick = [(1.0 + 0.2 * k, 1.0 + 0.2 * k) for k in range(5)]
        queued = [(2.0 + 0.2 * k, 6.0 + 0.01 * k) for k in range(8)]
        for sent, arrives in [*quick, *queued]:
            ahead = imc.RemoteActions(actions="Thrust=127")
            packet = imc.encode_with_header(ahead, self.now + 3600.0 + sent, CCU, 3, OWN, 0xFF)
            self.after(arrives, self.relay, packet)


@pytest.mark.parametrize("consoles", [1, 16])
def test_actions_that_were_on_the_way_for_long_are_not_obeyed(consoles):
    class Crowd(DelayedConsole):
        others = consoles - 1

    states = [imc.EstimatedState(timestamp=0.05 * k, depth=3.0) for k in range(140)]
    run = simulate([RemoteOperation, Crowd], [enabled(), *states], seconds=7.0)
    thrusts = [(m.timestamp - run.vehicle.start_time, m.value) for m in run.of(imc.DesiredSpeed)]
    assert max(value for time, value in thrusts if time < 2.0) == pytest.approx(70.0)
    assert {value for time, value in thrusts if time > 4.0} == {0.0}
    late = "no remote action for 2 s: the latest came 2.7 s late"
    assert run.task.entity.description == late if consoles == 1 else run.task.entity.state is State.NORMAL


class ConsoleWithoutClock(Task):
    """Commands that all have the same time."""

    sent = 0.0

    def start(self):
        packet = imc.encode_with_header(imc.RemoteActions(actions="Thrust=127"), self.sent, CCU, 3, OWN, 0xFF)
        for k in range(30):
            self.after(1.0 + 0.2 * k, self.relay, packet)


@pytest.mark.parametrize("time", [0.0, math.nan, math.inf])
def test_a_console_without_a_clock_steers(time):
    class Console(ConsoleWithoutClock):
        sent = time

    states = [imc.EstimatedState(timestamp=0.05 * k, depth=3.0) for k in range(140)]
    run = simulate([RemoteOperation, Console], [enabled(), *states], seconds=7.0)
    assert min(m.value for m in run.of(imc.DesiredSpeed)[10:]) == pytest.approx(70.0)


def test_a_console_is_reported_what_there_is():
    query = imc.RemoteActionsRequest(timestamp=1.0, src=CCU, src_ent=3, op=imc.RemoteActionsRequest.Op.QUERY)
    begun, answer = steered(query, query.replace(dst=OWN + 1)).of(imc.RemoteActionsRequest)
    assert (begun.dst, answer.dst, answer.dst_ent, answer.op) == (0xFFFF, CCU, 3, imc.RemoteActionsRequest.Op.REPORT)
    wanted = "Exit=Button;Accelerate=Button;Decelerate=Button;Stop=Button;Heading=Axis;Thrust=Axis;Pitch=Axis"
    assert answer.actions == f"{wanted};Ranges=Range127"


def test_tuples():
    assert parse_tuple_list(" a = 1 ;b=2=3;;c; a=4") == {"a": "4", "b": "2=3", "c": ""}
    assert [parse_tuple_list_integer(text, "src") for text in ("src=0x4001", "src=7;x=1", "src=x", "")] == [
        0x4001,
        7,
        None,
        None,
    ]


@pytest.mark.heavy
def test_teleoperation_moves_the_vehicle_until_its_operator_leaves(tmp_path: Path):
    made = prepare(
        "lauv-noptilus-1", overrides=(UNLOGGED, BLIND), log_root=tmp_path / "log", state_folder=tmp_path / "db"
    )
    vehicle, begin = made.vehicle, made.vehicle.start_time
    states, replies = list[imc.SimulatedState](), list[str]()
    vehicle.observe(imc.SimulatedState, states.append)
    vehicle.observe(imc.PlanControl, lambda m: replies.append(m.info) if m.dst == CCU else None)

    def say(message, now):
        packet = imc.encode_with_header(message, now, CCU, 3, OWN, 0xFF)
        vehicle.bus.deliver_and_send(imc.decode(packet), packet, None)

    async def console(script):
        await script.sleep(12.0)
        op, steering = imc.PlanControl.Op.START, imc.Teleoperation(custom=f"src={CCU}")
        say(imc.PlanControl(op=op, plan_id="teleoperation-mode", request_id=1, arg=steering), script.now)
        while script.now < begin + 30.0:
            await script.sleep(0.2)
            say(imc.RemoteActions(actions="Thrust=80;Heading=20"), script.now)
        await script.sleep(15.0)
        say(imc.TeleoperationDone(), script.now)

    vehicle.start()
    vehicle.kernel.soon(vehicle.daemon.start_script, console)
    vehicle.run(48.0)
    vehicle.close()

    def at(time):
        return next(state for state in states if state.timestamp - begin >= time)

    assert at(28.0).u > 0.8
    assert at(28.0).r == pytest.approx(math.radians(40.0) * 20.0 / 127.0, abs=0.03)
    assert math.dist((at(12.0).x, at(12.0).y), (at(30.0).x, at(30.0).y)) > 8.0
    assert abs(at(44.0).u) < 0.2, "the operator has been silent for 14 s"
    assert replies[-1] == "plan completed"
