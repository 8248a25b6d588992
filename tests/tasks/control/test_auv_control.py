"""The controllers of an underwater vehicle, each alone."""

import math

import pytest

import imc
from runtime import State, consume
from runtime.testing import simulate
from tasks.control.auv.allocator import Allocator
from tasks.control.auv.attitude import Attitude
from tasks.control.auv.speed import Speed

Loops = imc.CLoopsMask
DEPTH, ALTITUDE = imc.ZUnits.DEPTH, imc.ZUnits.ALTITUDE
AFTER = 0.02  # s; a run continues this long after its feed
LIMITS = {"General": {"Absolute Maximum Depth": "50", "Absolute Minimum Altitude": "1.2"}}


def enable(mask, scope=1, time=0.1, on=1):
    return imc.ControlLoops(timestamp=time, enable=on, mask=mask, scope_ref=scope)


def states(seconds, start=0.2, **fields):
    fields = {"alt": -1.0} | fields
    return [imc.EstimatedState(timestamp=start + 0.05 * i, **fields) for i in range(round(seconds * 20))]


def attitude(feed, **parameters):
    return simulate(Attitude, feed=feed, settings=LIMITS, **parameters)


def test_nothing_is_controlled_before_a_loop_is_enabled():
    run = attitude([imc.DesiredHeading(timestamp=0.1, value=1.0), *states(1.0)])
    assert run.of(imc.DesiredControl) == []


def test_the_torques_are_enabled_in_the_scope_of_the_maneuver():
    run = attitude([enable(Loops.YAW, scope=7), enable(Loops.ALL, scope=8, time=0.5, on=0)])
    assert [(m.enable, m.mask, m.scope_ref) for m in run.of(imc.ControlLoops)] == [
        (1, Loops.TORQUE, 7),
        (0, Loops.TORQUE, 8),
    ]


def test_a_heading_to_starboard_needs_a_positive_yaw_torque():
    run = attitude([enable(Loops.YAW), imc.DesiredHeading(timestamp=0.15, value=0.2), *states(1.0)])
    control = run.of(imc.DesiredControl)[-1]
    assert control.n == pytest.approx(1.2 * 1.5 * 0.2)
    assert run.of(imc.DesiredHeadingRate)[-1].value == pytest.approx(0.3)
    assert control.flags == 0x38


def test_the_shorter_way_round():
    feed = [enable(Loops.YAW), imc.DesiredHeading(timestamp=0.15, value=-3.0), *states(1.0, psi=3.0)]
    assert attitude(feed).of(imc.DesiredControl)[-1].n > 0.0


def test_a_depth_below_needs_the_nose_down():
    feed = [enable(Loops.DEPTH), imc.DesiredZ(timestamp=0.15, value=3.0, z_units=DEPTH), *states(1.0)]
    run = attitude(feed)
    assert run.of(imc.DesiredPitch)[-1].value == pytest.approx(math.radians(-15.0))
    assert run.of(imc.DesiredControl)[-1].m < 0.0


def test_a_pitch_is_followed_while_its_loop_is_enabled_whatever_the_depth():
    feed = [
        enable(Loops.PITCH),
        imc.DesiredPitch(timestamp=0.15, value=0.2),
        imc.DesiredZ(timestamp=0.16, value=9.0, z_units=DEPTH),
        *states(1.0),
    ]
    assert attitude(feed).of(imc.DesiredControl)[-1].m > 0.2


def test_references_of_one_axis_stay_when_a_loop_of_the_other_is_enabled():
    feed = [
        enable(Loops.PITCH),
        imc.DesiredPitch(timestamp=0.15, value=0.2),
        enable(Loops.YAW, time=0.16),
        imc.DesiredHeading(timestamp=0.17, value=0.1),
        *states(1.0),
    ]
    control = attitude(feed).of(imc.DesiredControl)[-1]
    assert control.m > 0.2
    assert control.n > 0.1


def test_depth_and_altitude_are_kept_within_the_limits_and_it_is_said():
    feed = [
        enable(Loops.DEPTH),
        imc.DesiredZ(timestamp=0.15, value=70.0, z_units=DEPTH),
        imc.DesiredZ(timestamp=0.25, value=0.5, z_units=ALTITUDE),
        imc.DesiredZ(timestamp=0.35, value=5.0, z_units=DEPTH),
    ]
    found = [(m.value, m.z_units) for m in attitude(feed).of(imc.DesiredZ)]
    assert found == [(49.0, DEPTH), (pytest.approx(1.4), ALTITUDE)]


def test_stricter_limits_are_followed():
    limits = imc.OperationalLimits(timestamp=0.1, mask=imc.OpLimitsMask.MAX_DEPTH, max_depth=10.0)
    feed = [limits, enable(Loops.DEPTH), imc.DesiredZ(timestamp=0.2, value=20.0, z_units=DEPTH)]
    assert [m.value for m in attitude(feed).of(imc.DesiredZ)] == [9.0]


def test_an_altitude_leads_down_where_the_bottom_is_far_and_up_where_it_is_near():
    def pitch(altitude):
        feed = [enable(Loops.ALTITUDE), imc.DesiredZ(timestamp=0.15, value=5.0, z_units=ALTITUDE)]
        return attitude([*feed, *states(2.0, depth=10.0, alt=altitude)]).of(imc.DesiredPitch)[-1].value

    assert pitch(9.0) < 0.0 < pitch(2.0)


def test_an_altitude_that_is_unknown_for_too_long_is_an_error():
    feed = [enable(Loops.ALTITUDE), imc.DesiredZ(timestamp=0.15, value=5.0, z_units=ALTITUDE)]
    run = attitude([*feed, *states(5.0, depth=10.0, alt=-1.0)], altitude_timeout=3.0)
    assert run.task.entity.state is State.ERROR
    assert run.of(imc.DesiredPitch)[-1].value == pytest.approx(0.0)


def test_the_surface_is_held_with_a_pitch():
    feed = [enable(Loops.DEPTH), imc.DesiredZ(timestamp=0.15, value=0.0, z_units=DEPTH), *states(1.0, depth=0.1)]
    run = attitude(feed, force_pitch_at_surface=True, pitch_angle_at_surface=5.0)
    assert run.of(imc.DesiredPitch)[-1].value == pytest.approx(math.radians(5.0))


@pytest.mark.parametrize(("mask", "what"), [(Loops.YAW, "yaw"), (Loops.DEPTH, "vertical")])
def test_a_loop_without_reference_is_an_error(mask, what):
    run = attitude([enable(mask), *states(6.0)])
    assert run.task.entity.state is State.ERROR
    assert run.task.entity.description == f"timed out while waiting for {what} control mode"


def test_references_that_are_no_numbers_are_refused_and_said():
    feed = [
        enable(Loops.YAW | Loops.DEPTH),
        imc.DesiredHeading(timestamp=0.15, value=math.nan),
        imc.DesiredZ(timestamp=0.15, value=math.inf, z_units=DEPTH),
        imc.DesiredZ(timestamp=0.15, value=3.0, z_units=imc.ZUnits.HEIGHT),
        *states(1.0),
    ]
    run = attitude(feed)
    assert [(m.m, m.n) for m in run.of(imc.DesiredControl)] == [(0.0, 0.0)] * 20
    assert len([text for text in run.log if text.startswith("desired ")]) == 3


def test_the_parts_of_the_laws_have_entities_of_their_own():
    run = attitude([enable(Loops.YAW), imc.DesiredHeading(timestamp=0.15, value=0.2), *states(0.1)], log_parcels=True)
    labels = {run.vehicle.entities.label(m.src, m.src_ent) for m in run.of(imc.ControlParcel)}
    assert labels == {f"{name} Parcel" for name in ("Heading", "Heading Rate", "Depth", "Altitude", "Pitch", "Roll")}


def before_end(run, kind):
    """The messages of a type, without those published when the task stops."""
    end = run.vehicle.kernel.now_ns * 1e-9
    return [m for m in run.of(kind) if m.timestamp < end - 0.5 * AFTER]


def fins(feed):
    """The run, and the positions of the four fins, without those published when the task stops."""
    run = simulate(Allocator, feed=feed, seconds=feed[-1].timestamp + AFTER)
    moves = before_end(run, imc.SetServoPosition)
    return run, [tuple(m.value for m in moves[i : i + 4]) for i in range(0, len(moves), 4)]


def torque(time, **fields):
    return imc.DesiredControl(timestamp=time, flags=0x38, **fields)


def test_torques_move_fins_and_no_torque_loop_centres_them():
    run, found = fins([enable(Loops.TORQUE), torque(0.2, n=0.1, m=0.2), enable(Loops.ALL, 2, 0.3, 0)])
    assert found == [pytest.approx((-0.1, -0.2, -0.2, -0.1)), (0.0, 0.0, 0.0, 0.0)]
    allocated = run.of(imc.AllocatedControlTorques)[0]
    assert (allocated.k, allocated.m, allocated.n) == pytest.approx((0.0, 0.2, 0.1))


def test_fins_are_no_faster_than_they_can():
    _, found = fins([enable(Loops.TORQUE), torque(0.2, n=0.4), torque(0.21, n=-0.4), torque(0.26, n=-0.4)])
    assert found[1][0] == pytest.approx(-0.4 + math.radians(3.0), abs=1e-4)
    assert found[2][0] == pytest.approx(-0.4 + math.radians(18.0), abs=1e-4)


def test_torques_that_are_no_numbers_move_nothing():
    run, found = fins([enable(Loops.TORQUE), torque(0.2, n=math.nan)])
    assert found == []
    assert run.log[-1].startswith("desired torques are not numbers")


def test_a_brake_crosses_the_fins_until_it_ends():
    brake = imc.Brake(timestamp=0.15, op=imc.Brake.Op.START)
    release = imc.Brake(timestamp=0.5, op=imc.Brake.Op.STOP)
    _, found = fins([enable(Loops.TORQUE), brake, torque(0.2), release, torque(0.9)])
    assert found[0] == pytest.approx([0.8 * math.radians(25.0) * sign for sign in (1, 1, -1, -1)])
    assert found[1] == pytest.approx((0.0, 0.0, 0.0, 0.0))


def thrust(speed, units, seconds=20.0, extra=(), u=0.0, **parameters):
    """The run, and the actuations, without the one published when the task stops."""
    feed = [enable(Loops.SPEED), imc.DesiredSpeed(timestamp=0.15, value=speed, speed_units=units), *extra]
    for state in states(seconds, u=u):
        feed += [state, imc.Rpm(timestamp=state.timestamp + 0.01)]
    settings = {"General": {"Maximum Underwater RPMs": "1700"}}
    feed = sorted(feed, key=lambda m: m.timestamp)
    run = simulate(Speed, feed=feed, settings=settings, seconds=feed[-1].timestamp + AFTER, **parameters)
    return run, [m.value for m in before_end(run, imc.SetThrusterActuation)]


def test_a_share_and_a_rate_become_thrust_at_each_measured_rate():
    found = thrust(40.0, imc.SpeedUnits.PERCENTAGE, seconds=1.0)[1]
    assert found == pytest.approx([0.4] * 20)
    assert thrust(1250.0, imc.SpeedUnits.RPM, seconds=1.0)[1] == pytest.approx([0.5] * 20)


def test_a_speed_is_ramped_and_limited():
    _, found = thrust(1.4, imc.SpeedUnits.METERS_PS, seconds=30.0, minimum_rpm=200.0)
    assert found[1] * 2500.0 == pytest.approx(200.0, abs=1.0)
    assert (found[200] - found[100]) * 2500.0 == pytest.approx(400.0, abs=5.0)
    assert found[-1] * 2500.0 == pytest.approx(1700.0, abs=1.0)


def test_an_error_is_integrated_until_its_limit():
    _, found = thrust(1.0, imc.SpeedUnits.METERS_PS, seconds=100.0, u=1.4, rpm_acceleration=1e6)
    assert found[1] * 2500.0 == pytest.approx(1000.0, abs=1.0)
    assert found[200] * 2500.0 == pytest.approx(900.0, abs=1.0)
    assert found[-1] * 2500.0 == pytest.approx(600.0, abs=1.0)


def accelerated(derivative):
    """Actuations at a surge that grows from 0.2 m/s by 0.5 m/s per second."""
    feed = [enable(Loops.SPEED), imc.DesiredSpeed(timestamp=0.15, value=1.0, speed_units=imc.SpeedUnits.METERS_PS)]
    for index, state in enumerate(states(2.0)):
        feed += [state.replace(u=0.2 + 0.025 * index), imc.Rpm(timestamp=state.timestamp + 0.01)]
    gains = {"speed_gains": [0.0, 0.0, derivative], "speed_feedforward": 500.0, "rpm_acceleration": 1e6}
    run = simulate(Speed, feed=feed, settings={"General": {"Maximum Underwater RPMs": "1700"}}, **gains)
    return [m.value * 2500.0 for m in before_end(run, imc.SetThrusterActuation)]


def test_a_gain_on_the_rate_of_the_speed_damps_it():
    assert accelerated(0.0)[1:] == pytest.approx([500.0] * 38, abs=0.1)
    assert accelerated(200.0)[1:] == pytest.approx([400.0] * 38, abs=0.1)


def test_a_speed_of_nothing_is_no_thrust():
    assert set(thrust(0.05, imc.SpeedUnits.METERS_PS, seconds=2.0)[1]) == {0.0}


@pytest.mark.parametrize(
    "stop",
    [
        imc.Abort(timestamp=1.0, src=0x1234, dst=0x1A),
        imc.Abort(timestamp=1.0, src=0x1234, dst=0xFFF0),
        imc.Abort(timestamp=1.0, src=0x4000, dst=0xFFFF),
        imc.Brake(timestamp=1.0, op=imc.Brake.Op.START),
        enable(Loops.ALL, scope=2, time=1.0, on=0),
    ],
)
def test_abort_brake_and_disabled_loops_stop_the_thruster(stop):
    _, found = thrust(1000.0, imc.SpeedUnits.RPM, seconds=3.0, extra=[stop])
    assert found[10] == pytest.approx(0.4)
    assert found[-1] == 0.0


def test_an_abort_for_somebody_else_stops_nothing():
    other = imc.Abort(timestamp=1.0, src=0x1234, dst=0x1B)
    assert thrust(1000.0, imc.SpeedUnits.RPM, seconds=3.0, extra=[other])[1][-1] == pytest.approx(0.4)


def test_a_speed_that_is_no_number_is_refused():
    run, found = thrust(math.nan, imc.SpeedUnits.METERS_PS, seconds=1.0)
    assert found == []
    assert run.log[-1].startswith("invalid desired speed: ")


def test_the_rate_is_controlled_where_the_motor_does_not():
    _, found = thrust(1000.0, imc.SpeedUnits.RPM, seconds=5.0, hardware_control=False)
    assert found[0] == pytest.approx(0.39, abs=0.01)
    assert found[-1] == 1.0


def test_a_gain_on_the_rate_of_the_motor_damps_it():
    feed = [enable(Loops.SPEED), imc.DesiredSpeed(timestamp=0.15, value=900.0, speed_units=imc.SpeedUnits.RPM)]
    feed += [imc.Rpm(timestamp=0.2 + 0.05 * index, value=20 * index) for index in range(20)]
    gains = {"rpm_gains": [0.0, 0.0, 5e-4], "rpm_feedforward": 1e-3}
    run = simulate(Speed, feed=feed, hardware_control=False, **gains)
    found = [m.value for m in before_end(run, imc.SetThrusterActuation)]
    assert found == pytest.approx([0.9] + [0.7] * 18, abs=1e-6)


class Unsound(Speed):
    """Fails at the second braking."""

    @consume
    def brake(self, brake: imc.Brake) -> None:
        if brake.op == imc.Brake.Op.REVERT:
            raise RuntimeError("unsound")


def test_a_controller_that_fails_stops_the_thruster():
    feed = [enable(Loops.SPEED), imc.DesiredSpeed(timestamp=0.15, value=50.0, speed_units=imc.SpeedUnits.PERCENTAGE)]
    feed += [imc.Rpm(timestamp=0.2 + 0.05 * k) for k in range(20)]
    run = simulate(Unsound, [*feed, imc.Brake(timestamp=1.5, op=imc.Brake.Op.REVERT)], seconds=5.0, keep_going=True)
    found = [(round(m.timestamp - run.vehicle.start_time, 2), m.value) for m in run.of(imc.SetThrusterActuation)]
    assert found[19:21] == [(1.15, 0.5), (1.5, 0.0)]
    assert {value for _, value in found[20:]} == {0.0}


@pytest.mark.parametrize(("task", "kind"), [(Speed, imc.SetThrusterActuation), (Allocator, imc.SetServoPosition)])
def test_the_end_of_a_controller_leaves_its_actuators_neutral(task, kind):
    feed = [
        enable(Loops.SPEED | Loops.TORQUE),
        imc.DesiredSpeed(timestamp=0.15, value=50.0, speed_units=imc.SpeedUnits.PERCENTAGE),
        imc.Rpm(timestamp=0.2),
        torque(0.2, n=0.1, m=0.2),
    ]
    moves = simulate(task, feed, seconds=1.0).of(kind)
    assert moves[0].value != 0.0
    assert {m.value for m in moves[-4:] if m.timestamp == moves[-1].timestamp} == {0.0}


def test_a_motor_that_says_nothing_of_itself_is_stopped():
    feed = [enable(Loops.SPEED), imc.DesiredSpeed(timestamp=0.15, value=50.0, speed_units=imc.SpeedUnits.PERCENTAGE)]
    run = simulate(Speed, [*feed, *(imc.Rpm(timestamp=0.2 + 0.05 * k) for k in range(40))], seconds=6.0)
    found = [(m.timestamp - run.vehicle.start_time, m.value) for m in run.of(imc.SetThrusterActuation)]
    assert [value for _, value in found[39:41]] == [0.5, 0.0]
    assert 4.15 < found[40][0] <= 5.15, "last heard at 2.15 s"
    assert run.task.entity.description == "no Rpm for 2 s"


@pytest.mark.parametrize("unit", [imc.SpeedUnits.METERS_PS, imc.SpeedUnits.PERCENTAGE])
def test_a_thruster_does_not_go_on_when_navigation_falls_silent(unit):
    feed = [enable(Loops.SPEED), imc.DesiredSpeed(timestamp=0.15, value=1.0, speed_units=unit), *states(2.0)]
    run = simulate(Speed, [*feed, *(imc.Rpm(timestamp=0.2 + 0.05 * k) for k in range(120))], seconds=6.0)
    moving = [m.timestamp - run.vehicle.start_time for m in run.of(imc.SetThrusterActuation) if m.value]
    assert 4.0 <= moving[-1] <= 5.2, "the last state was at 2.15 s"
    assert run.task.entity.description == "no EstimatedState for 2 s"


def test_attitude_says_that_navigation_is_silent_until_it_is_told_to_rest():
    off = enable(Loops.ALL, scope=2, time=6.0, on=0)
    run = attitude([enable(Loops.YAW), imc.DesiredHeading(timestamp=0.15), *states(2.0), off], seconds=7.0)
    said = [(m.state, m.description) for m in run.of(imc.EntityState)]
    assert (State.ERROR, "EstimatedState is missing") in said
    assert said[-1] == (State.NORMAL, "idle")


def test_fins_are_centered_when_attitude_falls_silent():
    feed = [enable(Loops.TORQUE), *(torque(0.2 + 0.05 * k, m=0.2) for k in range(40))]
    run = simulate(Allocator, feed, seconds=8.0)
    turned = [m.timestamp - run.vehicle.start_time for m in run.of(imc.SetServoPosition) if m.value]
    assert turned[-1] == pytest.approx(2.15)
    assert run.of(imc.SetServoPosition)[-1].value == 0.0
    assert run.task.entity.description == "no DesiredControl for 4 s"


def test_a_servo_that_falls_silent_is_an_error_until_it_speaks():
    feed = [imc.ServoPosition(timestamp=0.5 * k, id=k % 2) for k in range(10)]
    feed += [imc.ServoPosition(timestamp=5.0 + 0.5 * k, id=0) for k in range(8)]
    feed.append(imc.ServoPosition(timestamp=9.5, id=1))
    run = simulate(Allocator, feed, seconds=11.0)
    said = [(m.state, m.description) for m in run.of(imc.EntityState)]
    assert (State.ERROR, "no position from servo 1") in said
    assert run.task.entity.state is State.NORMAL
