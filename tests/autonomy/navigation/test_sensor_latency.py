"""Accelerometers and barometers that are late, and those that are not."""

import math
import sys
from bisect import bisect_right

import numpy as np
import pytest

from autonomy.navigation.sensor_latency import BarometerLagCheck, ThrustResponseCheck

GRAVITY, STEP = 9.80665, 0.05  # m/s², s


def thrust(time, height=2.0, period=3.0):
    return GRAVITY + height * math.sin(math.tau * time / period)


def compare(force, seconds=10.0, made=thrust):
    check, noise, found = ThrustResponseCheck(), np.random.default_rng(1), []
    for step in range(round(seconds / STEP)):
        now = STEP * step
        measured = force(now, made)
        check.update(now, STEP, made(now), None if measured is None else measured + 0.1 * noise.standard_normal())
        found.append(check.lags)
    return check, found


@pytest.mark.parametrize("share", [0.8, 1.0, 1.25])
def test_a_force_that_follows_the_thrust_is_not_late_whatever_the_load(share):
    assert not any(compare(lambda t, made: share * made(t - 0.06))[1])


@pytest.mark.parametrize("delay", [0.7, 1.5, 4.0])
def test_a_force_that_comes_late_is_found_within_a_second_of_change(delay):
    check, found = compare(lambda t, made: made(t - delay) if t > delay else GRAVITY)
    assert check.lags
    assert found.index(True) * STEP < 1.0


@pytest.mark.parametrize("delay", [0.7, 1.5, 4.0])
def test_a_delay_that_begins_in_calm_flight_is_found_with_few_searches(delay):
    """Calm forces wait to be compared: a search for each of them would stop a slow computer for 0.1 s."""
    rate, calm, check, noise = 100, 60.0, ThrustResponseCheck(), np.random.default_rng(2)
    searches, most, found = 0, 0, math.inf

    def count(frame, event, function):
        nonlocal searches
        searches += event == "c_call" and function is bisect_right

    def made(time):
        return thrust(time - calm) if time > calm else GRAVITY

    for step in range(round((calm + 8.0) * rate)):
        now, searches = step / rate, 0
        sys.setprofile(count)
        check.update(now, 1.0 / rate, made(now), made(now - delay) + 0.1 * noise.standard_normal())
        sys.setprofile(None)
        most, found = max(most, searches), min(found, now if check.lags else math.inf)
    assert calm < found < calm + 2.0
    assert most < 50


def test_a_load_that_is_lost_is_no_lag():
    def steady(t):
        return GRAVITY + 0.1 * math.sin(t)

    assert not any(compare(lambda t, made: made(t) * (1.0 if t < 5.0 else 1.25), made=steady)[1])


def test_a_force_that_follows_again_is_used_again():
    _, found = compare(lambda t, made: made(t - 1.5) if t < 5.0 else made(t), seconds=20.0)
    assert found[round(4.5 / STEP)]
    assert not found[-1]


def test_without_a_force_nothing_is_found():
    assert not any(compare(lambda t, made: None)[1])


def test_the_thrust_of_the_last_two_seconds_explains_a_force():
    check, _ = compare(lambda t, made: made(t), seconds=3.0)
    assert check.explains(2.95, 11.0)
    assert not check.explains(2.95, 15.0)
    assert not ThrustResponseCheck().explains(0.0, GRAVITY)


def descend(delay=0.0, gps=None, seconds=30.0, lie=0.0):
    """A descent that begins after 10 s, with an accelerometer that may show `lie` (m/s²) more from then on."""
    check, noise, down, speed, past = BarometerLagCheck(), np.random.default_rng(3), -40.0, 0.0, []
    check.start(40.0)
    for step in range(round(seconds / STEP)):
        now = STEP * step
        acceleration = 1.0 if 10.0 <= now < 12.0 else 0.0
        speed += STEP * acceleration
        down += STEP * speed
        past.append(down)
        seen = past[max(0, step - round(delay / STEP))] + 0.1 * noise.standard_normal()
        check.advance(STEP, acceleration + (lie if now >= 10.0 else 0.0))
        check.correct(STEP, seen, None if gps is None else gps(past, step))
    return check, down, speed


def test_a_barometer_that_shows_the_descent_does_not_contradict_the_accelerometer():
    check, down, speed = descend()
    assert not check.contradicts
    assert check.filter.position[0] == pytest.approx(down, abs=0.3)
    assert check.filter.velocity[0] == pytest.approx(speed, abs=0.2)


@pytest.mark.parametrize("delay", [1.5, 4.0])
def test_a_barometer_that_is_late_does(delay):
    assert descend(delay)[0].contradicts
    assert descend(delay, gps=lambda past, step: past[step])[0].contradicts


def test_heights_by_gps_side_with_the_barometer_where_the_accelerometer_lies():
    assert descend(lie=2.0)[0].contradicts
    assert not descend(lie=2.0, gps=lambda past, step: past[step])[0].contradicts
