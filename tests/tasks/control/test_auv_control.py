"""Attitude control and allocation of an underwater vehicle, each alone."""

import math

import pytest

import imc
from runtime import State
from runtime.testing import simulate
from tasks.control.auv.allocator import Allocator
from tasks.control.auv.attitude import Attitude
from tasks.control.auv.speed import Speed
from tests.tasks.control.underwater import AFTER, Loops, before_end, enable, states

DEPTH, ALTITUDE = imc.ZUnits.DEPTH, imc.ZUnits.ALTITUDE
LIMITS = {"General": {"Absolute Maximum Depth": "50", "Absolute Minimum Altitude": "1.2"}}


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
