"""The rotation rate and actuation of a thruster."""

import math
from dataclasses import replace

import pytest

from autonomy.control import PIDGains, ThrusterController, ThrusterGains

GAINS = ThrusterGains(
    speed=PIDGains(0.0, 25.0, 0.0, integral_limit=400.0),
    speed_feedforward=1000.0,
    rate=PIDGains(1e-3, 0.0, 0.0, limit=1.0),
    rate_feedforward=3e-4,
    acceleration=100.0,
    lowest=200.0,
    highest=2000.0,
    full=2500.0,
)


def test_a_speed_that_is_reached_needs_the_feed_forward():
    law = ThrusterController(GAINS)
    for _ in range(300):
        rpm = law.step_speed_loop(1.0, 1.0, 0.1)
    assert rpm == pytest.approx(1000.0)
    assert law.actuation(990.0, rpm, 0.1) == pytest.approx(0.4)


def test_the_rotation_rate_is_ramped_and_stays_within_its_limits():
    law = ThrusterController(replace(GAINS, speed=PIDGains(0.0, 0.0, 0.0)))
    assert law.step_speed_loop(0.0, 1.0, 0.1) == 200.0, "the lowest while moving"
    assert law.step_speed_loop(0.0, 1.0, 0.1) == pytest.approx(210.0)
    for _ in range(300):
        rpm = law.step_speed_loop(0.0, 5.0, 0.1)
    assert rpm == 2000.0


def test_the_integral_stays_within_its_limit():
    law = ThrusterController(GAINS)
    for _ in range(1000):
        rpm = law.step_speed_loop(0.5, 1.0, 0.1)
    assert rpm == pytest.approx(1400.0)
    law.reset_integrals()
    assert law.speed.i == 0.0
    assert law.rpm == rpm


def test_below_standstill_the_thruster_stops_at_once():
    law = ThrusterController(GAINS)
    law.step_speed_loop(0.0, 1.0, 0.1)
    assert law.step_speed_loop(0.0, 0.05, 0.1) == 0.0


def test_without_time_nothing_changes_but_the_speed_is_remembered():
    law = ThrusterController(replace(GAINS, speed=PIDGains(0.0, 0.0, 10.0), acceleration=1e6))
    assert law.step_speed_loop(1.0, 1.0, 0.0) == 0.0
    assert law.step_speed_loop(1.1, 1.0, 0.1) == pytest.approx(1000.0 - 10.0 * 1.0)


def test_what_is_not_wanted_or_not_a_number_is_not_hidden():
    law = ThrusterController(replace(GAINS, regulates_itself=False))
    assert law.actuation(100.0, None, 0.1) == 0.0
    assert law.measured == 100.0
    assert math.isnan(law.actuation(math.nan, 1000.0, 0.1))


def test_the_rate_is_controlled_where_the_motor_does_not():
    law = ThrusterController(replace(GAINS, regulates_itself=False))
    assert law.actuation(900.0, 1000.0, 0.1) == pytest.approx(1e-3 * 100.0 + 0.3)
    assert law.actuation(900.0, 0.0, 0.1) == 0.0
    damped = ThrusterController(replace(GAINS, regulates_itself=False, rate=PIDGains(0.0, 0.0, 1e-4)))
    damped.actuation(900.0, None, 0.1)
    assert damped.actuation(950.0, 1000.0, 0.1) == pytest.approx(0.3 - 1e-4 * 500.0)
    assert damped.actuation(990.0, 1000.0, 0.0) == pytest.approx(0.3), "too long ago for a rate"
