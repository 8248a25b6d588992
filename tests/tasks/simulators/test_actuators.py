"""Servos, motor, battery and current of a simulated vehicle."""

import math
from itertools import pairwise

import numpy as np
import pytest

import imc
from runtime import ParameterError
from runtime.testing import simulate
from tasks.simulators.battery import Battery
from tasks.simulators.motor import Motor
from tasks.simulators.servos import Servos
from tasks.simulators.stream_velocity import StreamVelocity

State = imc.EntityState.State
GENERAL = {
    "Battery Capacity": "700",
    "Power Model -- Conversion - RPM": "0, 500, 850, 1250, 1400",
    "Power Model -- Conversion - Watt": "0, 14, 23.5, 54, 70",
}


def wish(time, degrees, servo=0):
    return imc.SetServoPosition(timestamp=time, id=servo, value=math.radians(degrees))


def track(run, servo=0):
    return [
        (round(m.timestamp - run.vehicle.start_time, 4), round(math.degrees(m.value), 2))
        for m in run.of(imc.ServoPosition)
        if m.id == servo
    ]


def test_a_servo_turns_as_fast_as_it_can_and_says_when_it_arrives():
    run = simulate(Servos, [wish(0.5, 20.0)], seconds=0.9, maximum_rate=333.3)
    assert track(run) == [(0.0, 0.0), (0.52, 6.67), (0.54, 13.33), (0.56, 20.0), (0.56, 20.0)]


def test_a_small_turn_is_one_message_after_the_time_it_takes():
    run = simulate(Servos, [wish(0.5, 2.0, servo=3)], seconds=0.9, maximum_rate=200.0)
    assert track(run, 3) == [(0.0, 0.0), (0.51, 2.0)]
    assert len(run.of(imc.ServoPosition)) == 5


def test_a_new_wish_on_the_way():
    run = simulate(Servos, [wish(0.5, 30.0), wish(0.53, -10.0)], seconds=0.9, maximum_rate=100.0, update_rate=100.0)
    angles = [angle for _, angle in track(run)]
    assert max(angles) == pytest.approx(3.0, abs=0.01)
    assert angles[-1] == -10.0
    assert track(run)[-1][0] == pytest.approx(0.53 + 0.13, abs=0.001)


def test_limits_and_nonsense():
    nonsense = [wish(0.5, math.nan), wish(0.5, math.inf), wish(0.5, 5.0, servo=4), wish(0.5, 5.0, servo=255)]
    assert {angle for _, angle in track(simulate(Servos, nonsense, seconds=2.5))} == {0.0}
    assert track(simulate(Servos, [wish(0.5, -80.0)], seconds=2.5))[-1][1] == -45.0
    at_once = simulate(Servos, [wish(0.5, 40.0)], seconds=0.9, enable_rotation_rate=False)
    assert track(at_once)[1:] == [(0.5, 40.0)]


def test_stuck_servos():
    run = simulate(Servos, [wish(1.0, 10.0), wish(3.0, -10.0)], seconds=5.0, generate_faults=True, fault_time=2.0)
    assert track(run)[-1][1] == 10.0
    assert run.task.entity.state is State.ERROR


def test_twenty_wishes_a_second_are_as_many_positions():
    feed = [wish(0.05 * k, 10.0 * math.sin(0.05 * k), servo) for k in range(200) for servo in range(4)]
    run = simulate(Servos, feed, seconds=10.0)
    assert 700 <= len(run.of(imc.ServoPosition)) <= 900


@pytest.mark.parametrize(("actuation", "rpm"), [(0.5, 1234), (-0.5, -1234), (1.0, 2459), (0.09, 0), (0.1, 254)])
def test_rpm_of_an_actuation(actuation, rpm):
    run = simulate(Motor, [imc.SetThrusterActuation(timestamp=1.0, value=actuation)], seconds=2.0)
    speeds = [m.value for m in run.of(imc.Rpm)]
    assert (len(speeds), speeds[:20]) == (40, [0] * 20)
    assert speeds[-1] == rpm
    assert speeds[23] == pytest.approx(0.6 * rpm, abs=1) or rpm == 0


def test_a_motor_that_another_thruster_does_not_turn():
    feed = [imc.SetThrusterActuation(timestamp=0.1, id=1, value=0.5), imc.SetThrusterActuation(value=math.nan)]
    assert {m.value for m in simulate(Motor, feed, seconds=2.0).of(imc.Rpm)} == {0}


def test_a_battery_loses_what_is_drawn():
    push = imc.SetThrusterActuation(timestamp=1800.0, value=0.5)
    run = simulate(Battery, [push], seconds=3600.5, settings={"General": GENERAL}, hotel_load=35.0)
    volts, amperes = run.of(imc.Voltage), run.of(imc.Current)
    drawn = np.array([v.value * i.value for v, i in zip(volts, amperes, strict=True)])
    assert drawn[:1800] == pytest.approx(35.0, rel=1e-5)
    assert drawn[1801:] == pytest.approx(35.0 + 54.0, rel=1e-5)
    losses = np.array([0.1 * i.value**2 for i in amperes])
    levels = run.of(imc.FuelLevel)
    assert len(levels) == 361
    assert (levels[0].value, levels[0].confidence) == (100.0, 100.0)
    assert levels[-1].value == pytest.approx(100.0 - (drawn + losses)[1:3601].sum() / 36.0 / 700.0, abs=1e-3)
    assert all(a.value >= b.value for a, b in pairwise(volts))
    assert volts[1800].value - volts[1801].value > 0.1


def test_a_battery_ends_as_entities_say():
    run = simulate(Battery, seconds=600.0, capacity=1.0, hotel_load=20.0, initial_level=50.0)
    states = list(dict.fromkeys(m.state for m in run.of(imc.EntityState) if m.src_ent == run.task.entity.id))
    assert states == [State.NORMAL, State.FAULT, State.ERROR, State.FAILURE]
    assert run.of(imc.FuelLevel)[-1].value == 0.0
    assert (run.of(imc.Voltage)[-1].value, run.of(imc.Current)[-1].value) == (0.0, 0.0)


def test_beyond_the_power_model_power_grows_with_the_cube():
    push = imc.SetThrusterActuation(timestamp=0.0, value=-1.0)
    run = simulate(Battery, [push], seconds=5.0, settings={"General": GENERAL}, hotel_load=0.0)
    power = run.of(imc.Voltage)[-1].value * run.of(imc.Current)[-1].value
    assert power == pytest.approx(70.0 * (2500.0 / 1400.0) ** 3, rel=1e-5)


def test_a_load_that_no_battery_bears():
    run = simulate(Battery, seconds=5.0, hotel_load=1e6, internal_resistance=1.0)
    assert run.of(imc.Voltage)[0].value == pytest.approx(14.5, rel=1e-3)


@pytest.mark.parametrize(
    ("name", "options"),
    [
        (
            "Power Model -- Conversion -",
            {"settings": {"General": GENERAL | {"Power Model -- Conversion - RPM": "0, 1"}}},
        ),
        ("Battery Capacity", {"settings": {"General": {"Battery Capacity": "much"}}}),
        ("Voltage Curve", {"voltage_curve": [0.0, 25.0]}),
        ("Error Level", {"error_level": 50.0}),
    ],
)
def test_what_a_battery_cannot_be(name, options):
    with pytest.raises(ParameterError) as caught:
        simulate(Battery, **options)
    assert caught.value.name == name


def test_a_constant_current():
    run = simulate(StreamVelocity, seconds=3.0, default_speed_north=0.3, default_speed_down=-0.1)
    assert [(m.x, m.y, m.z) for m in run.of(imc.EstimatedStreamVelocity)] == [(0.3, 0.0, -0.1)] * 3


@pytest.mark.heavy
def test_a_current_that_varies():
    options = {"stream_velocity_source": "Gauss-Markov", "default_speed_east": 0.5, "time_constant": 10.0}
    run = simulate(StreamVelocity, seconds=20000.0, seed=3, standard_deviation=0.2, **options)
    east = np.array([m.y for m in run.of(imc.EstimatedStreamVelocity)])
    independent = len(east) / 20.0
    assert east.mean() == pytest.approx(0.5, abs=4.0 * 0.2 / math.sqrt(independent))
    assert east.std() == pytest.approx(0.2, rel=4.0 / math.sqrt(2.0 * independent))
    lagged = np.corrcoef(east[:-10], east[10:])[0, 1]
    assert lagged == pytest.approx(math.exp(-1.0), abs=0.15)
    again = simulate(StreamVelocity, seconds=100.0, seed=3, standard_deviation=0.2, **options)
    assert [m.y for m in again.of(imc.EstimatedStreamVelocity)] == east[:100].tolist()


def test_a_motor_that_nobody_drives_any_more_stops_and_says_so():
    pushes = [imc.SetThrusterActuation(timestamp=0.05 * k, value=0.5) for k in range(60)]
    run = simulate(Motor, pushes, seconds=8.0)
    ((stopped, thruster, value),) = [
        (m.timestamp - run.vehicle.start_time, m.id, m.value) for m in run.of(imc.SetThrusterActuation)
    ]
    assert (round(stopped - 2.95, 2), thruster, value) == (2.05, 0, 0.0)
    speeds = [m.value for m in run.of(imc.Rpm)]
    assert (speeds[95], speeds[-1]) == (1234, 0)
    assert run.log == ["no actuation for 2 s; the motor stops"]
    assert simulate(Motor, pushes, seconds=8.0, command_timeout=0.0).of(imc.Rpm)[-1].value == 1234


def test_servos_that_nobody_commands_any_more_go_to_the_middle():
    run = simulate(Servos, [wish(0.5, 20.0), wish(0.5, 10.0, 1), wish(2.5, 10.0, 1)], seconds=3.9)
    assert (track(run, 0)[-1][1], track(run, 1)[-1][1]) == (0.0, 10.0)
    assert run.log == ["no position for servo 0 in 2 s; it goes to the middle"]
    assert track(simulate(Servos, [wish(0.5, 20.0)], seconds=8.0, command_timeout=0.0))[-1][1] == 20.0
