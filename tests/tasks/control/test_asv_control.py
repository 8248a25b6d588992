"""The controllers of a boat, each alone."""

import math

import pytest

import imc
from runtime import State
from runtime.testing import simulate
from tasks.control.asv.conventional.heading import Heading
from tasks.control.asv.conventional.speed import Speed
from tasks.control.asv.heading_and_speed import HeadingAndSpeed
from tests.tasks.control.underwater import AFTER, STOPS, Loops, before_end, enable

MPS, RPM, PERCENT = imc.SpeedUnits.METERS_PS, imc.SpeedUnits.RPM, imc.SpeedUnits.PERCENTAGE
BOTH = Loops.YAW | Loops.SPEED


def states(seconds, start=0.2, **fields):
    return [imc.EstimatedState(timestamp=start + 0.05 * i, **fields) for i in range(round(seconds * 20))]


def heading(value, time=0.15):
    return imc.DesiredHeading(timestamp=time, value=value)


def speed(value, units=MPS, time=0.15):
    return imc.DesiredSpeed(timestamp=time, value=value, speed_units=units)


def run_of(cls, feed, **parameters):
    """A run that continues for a moment after its feed."""
    feed = sorted(feed, key=lambda m: m.timestamp)
    return simulate(cls, feed=feed, **({"seconds": feed[-1].timestamp + AFTER} | parameters))


def thrusts(run):
    """Actuations at port and at starboard, in pairs."""
    found = before_end(run, imc.SetThrusterActuation)
    assert [m.id for m in found] == [0, 1] * (len(found) // 2)
    return [(port.value, starboard.value) for port, starboard in zip(found[::2], found[1::2], strict=True)]


def differential(feed, **parameters):
    return run_of(HeadingAndSpeed, feed, **parameters)


def rudder(feed, **parameters):
    run = run_of(Heading, feed, **parameters)
    return run, [m.value for m in before_end(run, imc.SetServoPosition)]


def test_nothing_is_controlled_before_a_loop_is_enabled():
    assert set(thrusts(differential([heading(1.0), speed(1.0), *states(1.0)]))) == {(0.0, 0.0)}


def test_a_heading_to_starboard_needs_more_thrust_at_port():
    run = differential([enable(BOTH), heading(0.2), speed(40.0, PERCENT), *states(0.2)])
    port, starboard = thrusts(run)[1]
    assert port > 0.4 > starboard
    assert port**2 - 0.4**2 == pytest.approx(0.4**2 - starboard * abs(starboard), abs=1e-6)
    assert run.of(imc.DesiredHeadingRate)[0].value == pytest.approx(0.1)


def test_the_shorter_way_round():
    run = differential([enable(BOTH), heading(-3.0), speed(40.0, PERCENT), *states(0.2, psi=3.0)])
    port, starboard = thrusts(run)[1]
    assert port > starboard


def test_a_rate_is_followed_and_limited():
    rate = imc.DesiredHeadingRate(timestamp=0.15, value=9.0)
    run = differential([enable(Loops.YAW_RATE | Loops.SPEED), rate, speed(0.0), *states(0.2)], maximum_rate=10.0)
    port, starboard = thrusts(run)[1]
    assert (port, starboard) == pytest.approx((0.4763, -0.4763), abs=1e-3)
    wanted = math.radians(10.0) * (0.5 + 0.8)
    assert port**2 == pytest.approx(wanted, abs=1e-3)


def test_far_off_its_heading_a_boat_turns_before_it_goes():
    feed = [enable(BOTH), heading(2.0), speed(60.0, PERCENT)]
    port, starboard = thrusts(differential([*feed, *states(0.2)]))[1]
    assert port == pytest.approx(-starboard)
    port, starboard = thrusts(differential([*feed, *states(0.2)], heading_error=180.0))[1]
    assert port + starboard > 0.5


def test_the_integral_rests_at_the_limit():
    far = [enable(BOTH), heading(3.0), speed(0.0), *states(60.0)]
    there = states(0.5, start=60.2, psi=3.0)
    run = differential([*far, *there])
    last = thrusts(run)[-1]
    assert last[0] ** 2 < 0.35


def test_a_rudder_turns_to_port_with_a_positive_angle_and_less_when_the_boat_is_fast():
    def angle(u):
        return rudder([enable(Loops.YAW), heading(-0.1), *states(0.2, u=u)])[1][1]

    assert angle(1.5) == pytest.approx(0.1 * 0.5 * (0.5 + 0.8))
    assert angle(3.0) == pytest.approx(0.25 * angle(1.5))
    assert angle(0.0) == pytest.approx(4.0 * angle(1.5))


def test_a_rudder_stops_at_its_limit_and_its_integral_rests_there():
    feed = [enable(Loops.YAW), heading(1.5), *states(60.0, u=1.0), *states(1.0, start=60.2, psi=1.5, r=0.0, u=1.0)]
    _, found = rudder(feed, rate_gains=[2.0, 1.0, 0.0])
    assert min(found) == pytest.approx(math.radians(-25.0))
    assert found[-1] > math.radians(-25.0)


def test_a_rudder_is_amidships_when_its_loop_is_disabled():
    run, found = rudder([enable(Loops.YAW), heading(0.3), *states(1.0), enable(Loops.ALL, 2, 1.3, 0)])
    assert found[-2] < -0.1
    assert found[-1] == 0.0
    assert (run.task.entity.state, run.task.entity.description) == (State.NORMAL, "idle")


def thrust(value, units=MPS, seconds=20.0, extra=(), u=0.0, **parameters):
    feed = [enable(Loops.SPEED), speed(value, units), *extra, *states(seconds, u=u)]
    run = run_of(Speed, feed, full_thrust=1000.0, maximum_rpm=900.0, **parameters)
    return run, [m.value for m in before_end(run, imc.SetThrusterActuation)]


def test_shares_and_rates_are_taken_as_they_are():
    assert thrust(40.0, PERCENT, 1.0)[1][1:] == pytest.approx([0.4] * 20)
    assert thrust(-400.0, RPM, 1.0)[1][1:] == pytest.approx([-0.4] * 20)


def test_a_speed_is_ramped_and_limited():
    _, found = thrust(1.0, speed_feedforward=500.0, rpm_acceleration=100.0, speed_gains=[0.0, 0.0, 0.0])
    assert found[11] * 1000.0 == pytest.approx(50.0, abs=6.0)
    assert found[-1] == pytest.approx(0.5)
    assert thrust(5.0, rpm_acceleration=1e6)[1][-1] == pytest.approx(0.9)
    assert thrust(5.0, rpm_acceleration=1e6, highest_thrust=0.5)[1][-1] == pytest.approx(0.5)


def test_a_speed_of_nothing_is_no_thrust():
    assert set(thrust(0.05, seconds=2.0)[1]) == {0.0}


@pytest.mark.parametrize("stop", STOPS)
def test_abort_brake_and_disabled_loops_stop_the_motors(stop):
    run = differential([enable(BOTH), heading(0.1), speed(50.0, PERCENT), stop, *states(3.0)])
    assert thrusts(run)[10][0] > 0.4
    assert thrusts(run)[-1] == (0.0, 0.0)


def test_an_abort_for_somebody_else_stops_nothing():
    other = imc.Abort(timestamp=1.0, src=0x1234, dst=0x1B)
    assert thrust(40.0, PERCENT, extra=[other])[1][-1] == pytest.approx(0.4)


def test_a_boat_that_does_not_know_where_it_is_is_let_go():
    feed = [enable(BOTH), heading(0.1), speed(50.0, PERCENT), *states(3.0)]
    run = run_of(HeadingAndSpeed, feed, seconds=6.0)
    assert thrusts(run)[-1] == (0.0, 0.0)
    assert run.task.entity.state is State.ERROR
    assert run.task.entity.description == "EstimatedState is missing"


def test_a_loop_without_reference_is_an_error_until_it_has_one():
    run = differential([enable(BOTH), speed(1.0), *states(6.0)])
    assert run.task.entity.state is State.ERROR
    assert run.task.entity.description == "timed out while waiting for a reference"
    run = differential([enable(BOTH), speed(1.0), heading(0.0, time=6.0), *states(7.0)])
    assert run.task.entity.state is State.NORMAL


def test_references_outlive_a_change_of_parameters():
    patience = imc.EntityParameter(name="Reference Timeout", value="0")
    change = imc.SetEntityParameters(timestamp=1.0, name="HeadingAndSpeed", params=(patience,))
    run = differential([enable(BOTH), heading(0.1), speed(50.0, PERCENT), change, *states(3.0)])
    assert run.task.reference_timeout == 0.0
    assert sum(thrusts(run)[-1]) > 0.8
    assert run.task.entity.state is State.NORMAL


def test_references_that_are_none_are_refused_and_said():
    rate = imc.DesiredHeadingRate(timestamp=0.15, value=math.inf)
    loops = enable(BOTH | Loops.YAW_RATE)
    run = differential([loops, heading(math.nan), rate, speed(math.nan), speed(1.0, 9), *states(0.5)])
    assert set(thrusts(run)) == {(0.0, 0.0)}
    assert sum(text.startswith(("desired ", "invalid desired speed")) for text in run.log) == 4


def test_the_parts_of_the_laws_are_published_where_they_are_wanted():
    run = differential([enable(BOTH), heading(0.2), speed(1.0), *states(1.0)], log_parcels=True)
    assert len(run.of(imc.ControlParcel)) == 40
