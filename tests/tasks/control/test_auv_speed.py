"""The speed controller of an underwater vehicle, and what it does when something fails."""

import math

import pytest

import imc
from runtime import consume
from runtime.testing import simulate
from tasks.control.auv.speed import Speed
from tests.tasks.control.underwater import AFTER, STOPS, Loops, before_end, enable, states


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


@pytest.mark.parametrize("stop", STOPS)
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
    def cut_thrust_on_brake(self, brake: imc.Brake) -> None:
        if brake.op == imc.Brake.Op.REVERT:
            raise RuntimeError("unsound")


def test_a_controller_that_fails_stops_the_thruster():
    feed = [enable(Loops.SPEED), imc.DesiredSpeed(timestamp=0.15, value=50.0, speed_units=imc.SpeedUnits.PERCENTAGE)]
    feed += [imc.Rpm(timestamp=0.2 + 0.05 * k) for k in range(20)]
    run = simulate(Unsound, [*feed, imc.Brake(timestamp=1.5, op=imc.Brake.Op.REVERT)], seconds=5.0, keep_going=True)
    found = [(round(m.timestamp - run.vehicle.start_time, 2), m.value) for m in run.of(imc.SetThrusterActuation)]
    assert found[19:21] == [(1.15, 0.5), (1.5, 0.0)]
    assert {value for _, value in found[20:]} == {0.0}


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
