"""The last resort, alone: whom it watches, how it takes over, when it lets go."""

import math
from itertools import pairwise

import pytest
from flying import BROADCAST, CCU, OWN

import imc
from runtime import ParameterError, State
from runtime.fault_injection import Crash, Injection
from runtime.testing import START
from tasks.supervisors.failsafe import Failsafe
from tests.command import shoal
from tests.tasks.mission.stalling_clock import StallingClock
from tests.tasks.supervisors.guarded import ON, Loops, every, guarded


def errors(run):
    """Times (s) and texts of its errors."""
    own = [m for m in run.of(imc.EntityState) if m.src_ent == run.task.entity.id]
    return [(m.timestamp - run.vehicle.start_time, m.description) for m in own if m.state == State.ERROR]


def times(run, kind):
    return [m.timestamp - run.vehicle.start_time for m in run.of(kind)]


def test_it_beats_and_does_nothing_while_all_is_well():
    run = guarded(*every(imc.EstimatedState, 0.05, 10.0), *every(imc.PathControlState, 1.0, 10.0), ON)
    assert {type(m) for m in run.messages} == {imc.EntityState, imc.Heartbeat}
    assert len(run.of(imc.Heartbeat)) == 10


def test_what_was_never_heard_is_not_missed():
    assert not errors(guarded())


def test_silence_stops_maneuver_loops_and_actuators_and_aborts():
    run = guarded(*every(imc.EstimatedState, 0.05, 2.0), ON, imc.Depth(timestamp=0.1, value=10.0))
    at, text = errors(run)[0]
    assert 3.5 < at <= 4.0
    assert text == "no PathControlState for 3 s"
    (abort,) = run.of(imc.Abort)
    assert (abort.dst, abort.src) == (OWN, OWN)
    assert len(run.of(imc.StopManeuver)) == 1
    (off,) = run.of(imc.ControlLoops)
    assert (off.enable, off.mask, off.scope_ref) == (0, Loops.ALL, 5)
    assert {(m.id, m.value) for m in run.of(imc.SetThrusterActuation)} == {(0, 0.0)}
    assert {(m.id, m.value) for m in run.of(imc.SetServoPosition)} == {(0, 0.0), (1, 0.0)}
    assert len(run.of(imc.SetThrusterActuation)) > 15, "it goes on saying so"


def test_what_a_loop_needs_may_be_silent_without_the_loop():
    states = every(imc.EstimatedState, 0.05, 12.0)
    off = ON.replace(timestamp=5.0, enable=0, scope_ref=5)
    path = every(imc.PathControlState, 1.0, 5.0)
    assert not errors(guarded(*states, ON, *path, off, seconds=12.0))
    assert errors(guarded(*states, ON, *path, seconds=12.0))[0][1] == "no PathControlState for 3 s"
    assert errors(guarded(*states, ON, seconds=12.0)), "it may have been silent from the start"


def test_loops_that_are_enabled_again_are_disabled_again():
    again = [ON.replace(timestamp=6.0, scope_ref=90), ON.replace(timestamp=7.0, scope_ref=95)]
    run = guarded(*every(imc.EstimatedState, 0.05, 1.0), *again, seconds=9.0)
    assert [m.scope_ref for m in run.of(imc.ControlLoops)] == [1, 91, 96]
    assert len(run.of(imc.StopManeuver)) == 3


def test_it_has_the_last_word():
    wild = [
        *every(imc.SetThrusterActuation, 0.1, 9.0, id=0, value=0.8),
        *every(imc.SetServoPosition, 0.1, 9.0, id=1, value=0.3),
        *every(imc.SetThrusterActuation, 0.1, 9.0, id=7, value=0.8),
    ]
    last = {}
    run = guarded(*every(imc.EstimatedState, 0.05, 1.0), *wild, seconds=9.05)
    for message in [*wild, *run.messages]:
        if isinstance(message, imc.SetThrusterActuation | imc.SetServoPosition):
            last[type(message).__name__, message.id] = message.value
    assert last == {("SetThrusterActuation", 0): 0.0, ("SetServoPosition", 0): 0.0, ("SetServoPosition", 1): 0.0} | {
        ("SetThrusterActuation", 7): pytest.approx(0.8)
    }
    answers = [t for t in times(run, imc.SetThrusterActuation) if 5.0 < t < 8.99]
    assert len(answers) > 39, "each command has its answer"


def test_it_lets_go_when_all_is_received_and_the_vehicle_is_at_the_surface():
    states = [*every(imc.EstimatedState, 0.05, 1.0), *every(imc.EstimatedState, 0.05, 20.0, begin=8.0)]
    depths = [imc.Depth(timestamp=0.1 * k, value=max(0.0, 10.0 - 0.1 * k)) for k in range(200)]
    run = guarded(*states, *depths, seconds=20.0)
    released = [m for m in run.of(imc.EntityState) if m.state == State.NORMAL][-1]
    assert released.description == "active"
    late = guarded(*states, *(m.replace(value=10.0) for m in depths), seconds=20.0)
    assert late.task.entity.state is State.ERROR, "still under water"
    wild = imc.SetThrusterActuation(timestamp=19.9, id=0, value=0.5)
    assert times(guarded(*states, *depths, wild, seconds=20.0), imc.SetThrusterActuation)[-1] < 19.8


@pytest.mark.parametrize(("limit", "at"), [(50.0, 5.0), (20.0, 2.0)])
def test_the_measured_depth_counts_not_that_of_navigation(limit, at):
    limits = imc.OperationalLimits(timestamp=0.1, mask=imc.OpLimitsMask.MAX_DEPTH, max_depth=limit)
    depths = [imc.Depth(timestamp=0.1 * k, value=limit + 2.0 if k >= 10 * at else 5.0) for k in range(80)]
    run = guarded(limits, *depths, *every(imc.EstimatedState, 0.05, 10.0, depth=3.0))
    when, text = errors(run)[0]
    assert at + 1.0 < when < at + 1.6
    assert text == f"depth {limit + 2.0:.1f} m is deeper than the limit of {limit:g} m"


def test_a_steep_dive_ends_above_the_limit_and_a_usual_one_at_it():
    def dive(speed, start):
        depths = [imc.Depth(timestamp=0.1 * k, value=min(50.0, start + 0.1 * speed * k)) for k in range(200)]
        return errors(guarded(*depths, *every(imc.EstimatedState, 0.05, 20.0), seconds=20.0))

    assert not dive(0.45, 45.0)
    when, text = dive(1.3, 30.0)[0]
    assert 30.0 + 1.3 * when < 49.0
    assert text.endswith("m sinks at 1.3 m/s, too fast for the limit of 50 m")


def test_a_single_depth_that_is_wrong_changes_nothing():
    depths = [imc.Depth(timestamp=0.1 * k, value=1e6 if k % 9 == 0 else 5.0) for k in range(80)]
    assert not errors(guarded(*depths))


def test_a_depth_that_is_no_number_is_no_measurement():
    """Between depths that are too deep it does not say that they are not, and it leads to no command."""
    deep = [imc.Depth(timestamp=0.1 * k, value=math.nan if k % 5 == 0 else 60.0) for k in range(80)]
    assert "deeper than the limit" in errors(guarded(*deep))[0][1]
    heavy = [imc.Depth(timestamp=0.1 * k, value=math.nan if k == 20 else 6.0 + 0.01 * k) for k in range(500)]
    estimates = every(imc.EstimatedState, 1.0, 50.0, depth=math.nan)
    options = {"servos": [0, 1, 2, 3], "ascent_thrust": 0.6, "required_messages": []}
    run = guarded(*heavy, *estimates, seconds=50.0, **options)
    commands = [*run.of(imc.SetThrusterActuation), *run.of(imc.SetServoPosition)]
    assert any(m.value for m in commands)
    assert all(math.isfinite(m.value) for m in commands)


@pytest.mark.parametrize("vz", [0.0, math.nan])
def test_an_estimated_depth_counts_also_if_its_vertical_speed_is_unknown(vz):
    options = {"servos": [0, 1, 2, 3], "ascent_thrust": 0.6, "required_messages": []}
    run = guarded(*every(imc.EstimatedState, 0.5, 50.0, depth=8.0, vz=vz), seconds=50.0, **options)
    assert any(m.value for m in run.of(imc.SetThrusterActuation))


@pytest.mark.parametrize(("dst", "obeyed"), [(OWN, True), (BROADCAST, True), (0xFFFF, True), (0x1B, False)])
def test_it_obeys_an_abort_once_and_is_well_afterwards(dst, obeyed):
    run = guarded(ON, imc.Abort(timestamp=1.0, src=CCU, dst=dst), seconds=3.0)
    assert not errors(run)
    assert len(run.of(imc.StopManeuver)) == len(run.of(imc.ControlLoops)) == obeyed
    assert [m.value for m in run.of(imc.SetThrusterActuation)] == [0.0] * obeyed


@pytest.mark.parametrize(("rate", "dropped"), [(0.05, False), (0.0, True), (-0.05, True)])
def test_the_weight_is_dropped_if_the_vehicle_does_not_rise(rate, dropped):
    depths = [imc.Depth(timestamp=float(k), value=30.0 - rate * k) for k in range(100)]
    weight = {"drop_weight_channel": "Drop Weight", "drop_weight_delay": 60.0}
    run = guarded(*every(imc.EstimatedState, 0.05, 1.0), *depths, seconds=100.0, **weight)
    switched = run.of(imc.PowerChannelControl)
    assert [(m.name, m.op) for m in switched] == [("Drop Weight", imc.PowerChannelControl.Op.TURN_ON)] * dropped


@pytest.mark.parametrize(("rate", "dropped"), [(0.05, False), (-0.01, True)])
def test_the_time_in_which_the_process_stood_still_does_not_drop_the_weight(rate, dropped):
    """It has risen meanwhile, which the first depth after the stall tells."""
    depths = [imc.Depth(timestamp=float(k), value=30.0 - rate * k) for k in range(200) if not 10 < k < 71]
    weight = {"drop_weight_channel": "Drop Weight", "drop_weight_delay": 60.0}
    clock = StallingClock(round(START * 1e9), [(10.5, 60.0)])
    run = guarded(*every(imc.EstimatedState, 0.05, 1.0), *depths, seconds=200.0, clock=clock, **weight)
    assert len(run.of(imc.PowerChannelControl)) == dropped


@pytest.mark.parametrize(("rate", "worked"), [(0.02, True), (0.0, False)])
def test_an_ascent_by_motor_has_not_failed_because_the_process_stood_still(rate, worked):
    depths = [imc.Depth(timestamp=0.5 * k, value=30.0 - rate * 0.5 * k) for k in range(600) if not 60 < k < 145]
    options = {"servos": [0, 1, 2, 3], "ascent_thrust": 0.6, "ascent_delay": 20.0, "required_messages": []}
    run = guarded(*depths, seconds=280.0, clock=StallingClock(round(START * 1e9), [(30.2, 42.0)]), **options)
    assert any("do not bring the vehicle up" in text for text in run.log) is not worked


def test_attempts_to_come_up_are_as_long_and_as_often_after_a_long_stall():
    """The bow stays down, so that each attempt ahead ends soon and one astern follows."""

    def attempts(stall):
        """Times (s) without the stall at which the thrust changes, and the thrusts."""
        at = [0.1 * k + (stall if k >= 50 else 0.0) for k in range(1600)]
        angles = [imc.EulerAngles(timestamp=time, theta=-0.3) for time in at]
        rates = [imc.AngularVelocity(timestamp=time, y=-0.1) for time in at]
        depths = [imc.Depth(timestamp=time, value=30.0) for time in at]
        clock = StallingClock(round(START * 1e9), [(4.95, stall)])
        options = {"servos": [0, 1, 2, 3], "ascent_thrust": 0.6, "ascent_delay": 20.0, "required_messages": []}
        run = guarded(*angles, *rates, *depths, seconds=160.0 + stall, clock=clock, **options)
        sent = run.of(imc.SetThrusterActuation)
        changes = [sent[0], *(after for before, after in pairwise(sent) if after.value != before.value)]
        return [m.timestamp - run.vehicle.start_time - stall for m in changes], [m.value for m in changes]

    times, thrusts = attempts(600.0)
    usual_times, usual_thrusts = attempts(0.0)
    assert thrusts == usual_thrusts == pytest.approx([0.6, -0.6, 0.0, 0.6, -0.6, 0.0])
    assert times == pytest.approx(usual_times, abs=1.0)


def test_the_motor_stops_at_the_surface_where_a_depth_drifts_on_that_it_does_not_change():
    depths = [imc.Depth(timestamp=0.25 * k, value=6.0 + 0.015 * k) for k in range(480)]
    fixes = every(imc.GpsFix, 1.0, 120.0, type=imc.GpsFix.Type.STANDALONE, validity=imc.GpsFix.Validity.VALID_POS)
    options = {"seconds": 120.0, "servos": [0, 1, 2, 3], "ascent_thrust": 0.6, "required_messages": []}

    def driven(*feed):
        run = guarded(*feed, **options)
        commands = run.of(imc.SetThrusterActuation)
        return [m.timestamp - run.vehicle.start_time for m in commands if m.value]

    tried = driven(*depths, *fixes)
    assert 20.0 < tried[0] < 25.0
    assert tried[-1] < 34.0
    assert driven(*depths)[-1] > 65.0, "without fixes it tries astern, too"


def test_a_dive_is_not_stopped_for_ever_where_navigation_falls_silent():
    off = imc.ControlLoops(timestamp=1.0, enable=0, mask=Loops.PATH, scope_ref=5)
    dive = every(imc.EstimatedState, 0.1, 4.0, depth=20.0, theta=math.radians(-45.0), vz=0.3)
    options = {"servos": [0, 1, 2, 3], "ascent_thrust": 0.6, "required_messages": ["EstimatedState"]}
    run = guarded(ON, off, *dive, *every(imc.Depth, 0.25, 20.0, value=20.0), seconds=20.0, **options)
    driven = [m.timestamp - run.vehicle.start_time for m in run.of(imc.SetThrusterActuation) if m.value < 0.0]
    assert 1.0 < driven[0] < 3.0
    assert 7.0 < driven[-1] - driven[0] < 9.0


def test_a_dive_stop_is_reported_as_such_and_does_not_hide_the_ascent_after_it():
    off = imc.ControlLoops(timestamp=1.0, enable=0, mask=Loops.PATH, scope_ref=5)
    dive = every(imc.EstimatedState, 0.1, 60.0, depth=20.0, theta=math.radians(-45.0), vz=0.0)
    options = {"servos": [0, 1, 2, 3], "ascent_thrust": 0.6, "required_messages": []}
    run = guarded(ON, off, *dive, seconds=60.0, **options)
    texts = [text for text in run.log if "20.0 m" in text]
    assert "the bow is down by 45° at 20.0 m: going astern" in texts[0]
    assert "the vehicle does not rise at 20.0 m: ascending with motor and fins" in texts[1]
    at, text = errors(run)[0]
    assert at < 3.0
    assert text == "the bow is far down: going astern"


def test_a_depth_that_has_jumped_to_the_surface_is_doubted_where_gps_has_no_fix():
    fixes = every(imc.GpsFix, 1.0, 2.0, type=imc.GpsFix.Type.STANDALONE, validity=imc.GpsFix.Validity.VALID_POS)
    dive = [imc.Depth(timestamp=0.5 * k, value=0.2 * k) for k in range(30)]

    def driven(shown):
        """Times at which the motor runs; `shown` is the depth of a time after 15 s."""
        later = [imc.Depth(timestamp=0.5 * k, value=shown(0.5 * k - 15.0)) for k in range(30, 360)]
        options = {"seconds": 180.0, "servos": [0, 1, 2, 3], "ascent_thrust": 0.6, "required_messages": []}
        run = guarded(*fixes, *dive, *later, **options)
        return [m.timestamp - run.vehicle.start_time for m in run.of(imc.SetThrusterActuation) if m.value]

    jumped = driven(lambda t: 0.01)
    assert 70.0 < jumped[0] < 80.0
    assert jumped[-1] < 95.0, "it changes nothing"
    assert not driven(lambda t: 0.01 if t == 5.0 else max(0.01, 6.0 - 0.2 * t)), "a single one, and the way up"


@pytest.mark.parametrize("shown", [0.4, 4.9, -0.6, 1.5, 100.0, 6000.0])
@pytest.mark.parametrize("fixes", [0.0, 30.0])
def test_no_motor_turns_on_a_bench_whatever_a_depth_sensor_without_zero_shows(shown, fixes):
    """At 1.5 m it is set to zero after a minute; with fixes the vehicle was outside before; without a cable it shows
    the end of its range, beyond the limit of the vehicle."""
    fix = {"type": imc.GpsFix.Type.STANDALONE, "validity": imc.GpsFix.Validity.VALID_POS}
    depths = [imc.Depth(timestamp=0.5 * k, value=0.0 if shown == 1.5 and k > 120 else shown) for k in range(600)]
    options = {"seconds": 300.0, "servos": [0, 1, 2, 3], "ascent_thrust": 0.6, "required_messages": []}

    def turns(*more):
        run = guarded(*depths, *every(imc.GpsFix, 1.0, fixes, **fix), *more, **options)
        return any(m.value for m in run.of(imc.SetThrusterActuation))

    assert not turns()
    off = imc.ControlLoops(timestamp=1.0, enable=0, mask=Loops.PATH, scope_ref=5)
    assert turns(ON, off) or shown == -0.6, "after a control loop has been enabled it may be at sea"


@pytest.mark.parametrize("at", [0.25, 30.0])
@pytest.mark.parametrize("kind", [imc.Depth, imc.EstimatedState])
def test_a_single_wrong_depth_does_not_make_a_bench_the_sea(kind, at):
    field = "value" if kind is imc.Depth else "depth"
    wrong = [kind(timestamp=0.25 * k, **{field: 6.0 if 0.25 * k == at else 0.5}) for k in range(1, 400)]
    run = guarded(*wrong, seconds=100.0, servos=[0, 1, 2, 3], ascent_thrust=0.6, required_messages=[])
    assert not any(m.value for m in run.of(imc.SetThrusterActuation))


def test_a_restart_at_sea_forgets_neither_that_it_is_there_nor_a_plan_nor_a_silence():
    off = imc.ControlLoops(timestamp=1.0, enable=0, mask=Loops.PATH, scope_ref=5)
    options = {"servos": [0, 1, 2, 3], "ascent_thrust": 0.6, "required_messages": ["EstimatedState"]}
    crash = {"keep_going": True, "faults": [Injection(Crash(), start=8.0)]}

    def driven(*feed):
        run = guarded(*feed, seconds=60.0, **options, **crash)
        assert any("restarting" in text for text in run.log)
        return [m.timestamp - run.vehicle.start_time for m in run.of(imc.SetThrusterActuation) if m.value], run

    estimates = every(imc.EstimatedState, 0.5, 60.0, depth=3.0)
    assert 25.0 < driven(ON, off, *every(imc.Depth, 0.25, 60.0, value=3.0), *estimates)[0][0] < 35.0, "it is heavy"
    assert not driven(ON, *every(imc.Depth, 0.25, 60.0, value=10.0), *estimates)[0], "a plan dives"
    _, run = driven(*every(imc.EstimatedState, 0.5, 7.5))
    assert {text for at, text in errors(run) if at > 9.5} == {"no EstimatedState for 3 s"}
    resting = imc.VehicleState(timestamp=10.0, op_mode=imc.VehicleState.OpMode.ERROR)
    lost = ON.replace(timestamp=8.5, enable=0, scope_ref=5)
    assert driven(ON, lost, resting, *every(imc.Depth, 0.25, 60.0, value=10.0), *estimates)[0], "its plan has ended"


@pytest.mark.parametrize(
    ("text", "reason"),
    [("EstimatedStat", "did you mean 'EstimatedState'"), ("EstimatedState: PAHT", "did you mean 'PATH'")],
)
def test_a_misspelled_requirement_is_refused(text, reason):
    with pytest.raises(ParameterError, match=reason):
        guarded(required_messages=[text])


@pytest.mark.parametrize("vehicle", ["lauv-noptilus-1", "otter", "caravel", "hexa-00"])
def test_no_value_of_a_parameter_makes_it_wait_for_ever(vehicle):
    """On the shipped vehicles: neither the profile nor an operator can put off what saves the vehicle."""
    for option in ("Silence Timeout", "Depth Margin", "Drop Weight Delay", "Ascent Delay"):
        words = ["check", vehicle, "--set", f"Supervisors.Failsafe:{option}=1e6"]
        found = shoal(*words)
        assert found.exit_code == 1, found.output
        assert option in found.output
    editable = {parameter.name for parameter in Failsafe.parameters().values() if parameter.editable}
    assert editable == {
        *("Debug Level", "Execution Frequency", "Silence Timeout", "Depth Margin", "Drop Weight Delay"),
        "Ascent Thrust",  # 0 before somebody touches the motor
    }
