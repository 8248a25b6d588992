"""Vertical speed from accelerometer and barometer, and what remains without one of them."""

import math

import numpy as np
import pytest

from autonomy.navigation import VerticalSpeedEstimator

GRAVITY = 9.80665
STEP = 0.05  # s
UPRIGHT = 0.0, 0.0, 1.0


def pressure(height):
    """ISO 2533:1975, hPa."""
    return 1013.25 * (1.0 - 0.0065 * height / 288.15) ** 5.25588


def flown(seconds=20.0, climb=2.0, *, force=lambda f: f, height=lambda h, t: h, gps=None, seed=1):
    """After 5 s at rest a climb that begins with 2 m/s²: the estimator, and the true height and speed downward."""
    estimator, noise = VerticalSpeedEstimator(), np.random.default_rng(seed)
    h = v = now = 0.0
    for step in range(round((seconds + 5.0) / STEP)):
        now, rests = step * STEP, step * STEP < 5.0
        a = 0.0 if rests else max(-2.0, min(2.0, (climb - v) / STEP))
        v, h = v + STEP * a, h + STEP * v
        if (f := force(GRAVITY + a)) is not None:
            estimator.receive_force(now, 0.0, 0.0, -f)
        if (measured := height(h + 0.1 * noise.standard_normal(), now - 5.0)) is not None:
            estimator.receive_pressure(now, pressure(30.0 + measured))
        if gps is not None:
            estimator.receive_gps_height(gps(h) + noise.standard_normal())
        if rests:
            estimator.rest()
        else:
            estimator.advance(now, STEP, GRAVITY + a, UPRIGHT)
    return estimator, now, h, -v


def stuck():
    kept = []

    def lie(h, t):
        if t > 3.0:
            return kept[-1]
        kept[:] = [h]
        return h

    return lie


@pytest.mark.parametrize("climb", [-1.5, 0.0, 3.0])
@pytest.mark.parametrize("force", [lambda f: f, lambda f: None, lambda f: 1.3 * f, lambda f: 1000.0 * f])
def test_height_and_speed_are_measured_whatever_the_accelerometer_says(climb, force):
    estimator, now, height, speed = flown(climb=climb, force=force)
    assert estimator.has_height(now)
    assert estimator.has_speed(now)
    assert estimator.height == pytest.approx(height, abs=0.5)
    assert estimator.speed == pytest.approx(speed, abs=0.5)


@pytest.mark.parametrize(
    "lie",
    [
        lambda h, t: None if t > 3.0 else h,
        stuck(),
        lambda h, t: h + 900.0 * (t > 3.0),
        lambda h, t: h + 15.0 * (t > 3.0),
    ],
    ids=["silent", "stuck", "in feet", "another ground"],
)
def test_the_speed_goes_on_without_a_barometer_that_can_be_used(lie):
    estimator, now, _, speed = flown(height=lie)
    assert estimator.has_speed(now)
    assert estimator.speed == pytest.approx(speed, abs=0.7)


def test_the_accelerometer_alone_is_used_for_a_minute():
    def silent(h, t):
        return None if t > 3.0 else h

    for seconds, known in ((60.0, True), (66.0, False)):
        estimator, now, _, _ = flown(seconds, height=silent)
        assert not estimator.has_height(now)
        assert estimator.has_speed(now) is known


def test_heights_by_gps_are_used_where_there_is_no_barometer():
    estimator, now, _, speed = flown(
        90.0, 1.0, force=lambda f: None, height=lambda h, t: None if t > 3.0 else h, gps=lambda h: 84.0 + h
    )
    assert estimator.has_speed(now)
    assert estimator.speed == pytest.approx(speed, abs=0.7)


def test_a_speed_by_force_alone_that_gps_contradicts_is_replaced():
    estimator, noise, height = VerticalSpeedEstimator(), np.random.default_rng(4), 0.0
    estimator.rest()
    for step in range(200):
        now = STEP * step
        height += STEP * 12.0 * (step >= 20)  # climbs, while the accelerometer lies for a moment
        estimator.receive_force(now, 0.0, 0.0, -(1.0 if 20 <= step < 40 else GRAVITY) + 0.01 * noise.standard_normal())
        if step % 4 == 0:
            estimator.receive_gps_height(84.0 + height + noise.standard_normal())
        estimator.advance(now, STEP, 1.0 if 20 <= step < 40 else GRAVITY, UPRIGHT)
    assert estimator.speed < -4.0


def test_a_height_below_the_ground_is_corrected_by_gps():
    estimator, noise, fallen = VerticalSpeedEstimator(), np.random.default_rng(4), 0.0
    estimator.rest()
    for step in range(700):
        now = STEP * step
        force = GRAVITY if step >= 60 else 0.4 * GRAVITY  # 2.4 s that it does not fall in, and then it hovers
        estimator.receive_force(now, 0.0, 0.0, -force + 0.01 * noise.standard_normal())
        if step % 4 == 0:
            estimator.receive_gps_height(94.0 + noise.standard_normal())
        estimator.advance(now, STEP, force, UPRIGHT)
        fallen = max(fallen, estimator.speed)
    assert fallen > 5.0
    assert estimator.speed == pytest.approx(0.0, abs=1.0)


def test_on_the_ground_the_thrust_makes_no_speed():
    estimator, noise = VerticalSpeedEstimator(), np.random.default_rng(5)
    estimator.rest()
    for step in range(100):
        estimator.receive_force(STEP * step, 0.0, 0.0, -GRAVITY + 0.05 * noise.standard_normal())
        estimator.advance(STEP * step, STEP, 0.3 * GRAVITY, UPRIGHT)
    assert estimator.speed == pytest.approx(0.0, abs=0.1)


def test_what_is_not_a_number_changes_nothing():
    estimator = VerticalSpeedEstimator()
    estimator.rest()
    estimator.receive_force(0.0, 0.0, 0.0, math.nan)
    estimator.receive_pressure(0.0, math.nan)
    estimator.receive_gps_height(math.nan)
    estimator.advance(2.0, 2.0, GRAVITY, UPRIGHT)
    assert (estimator.height, estimator.speed) == (0.0, 0.0)
    assert not estimator.has_speed(2.0)


@pytest.mark.parametrize(("height", "speed", "wrong"), [(0, 0, False), (14, 1.5, False), (0, 2.5, True), (16, 0, True)])
def test_an_estimate_that_is_far_off_for_half_a_second_is_contradicted(height, speed, wrong):
    estimator, now, true, falling = flown()
    found = [estimator.contradicts(now, 0.1, true + height, falling + speed) for _ in range(6)]
    assert found == [False] * 4 + [wrong] * 2
    assert not estimator.contradicts(now, 0.1, true, falling)


def test_an_accelerometer_that_repeats_itself_is_not_used():
    estimator, noise = VerticalSpeedEstimator(), np.random.default_rng(2)
    for step in range(200):
        stuck = step >= 100
        estimator.receive_force(0.02 * step, 0.0, 0.0, -1.3 * GRAVITY if stuck else -GRAVITY + noise.standard_normal())
    assert estimator.measured_force(3.98, GRAVITY) is None


@pytest.mark.parametrize("carried", [3.0, -3.0])
def test_after_a_stall_the_speed_is_unknown_until_pressures_have_told_it(carried):
    """The last force before a stall, carried on through it, gives the estimator a speed that the vehicle has not."""
    estimator, now, height, _ = flown(climb=0.0)
    noise = np.random.default_rng(2)
    for step in range(60):
        passed = 1.0 if step == 0 else STEP
        now += passed
        if step < 20:
            estimator.resume()  # as long as the stall is recent
        estimator.receive_force(now, 0.0, 0.0, -(GRAVITY + (carried if step == 0 else 0.0)))
        estimator.receive_pressure(now, pressure(30.0 + height + 0.1 * noise.standard_normal()))
        estimator.advance(now, passed, GRAVITY, UPRIGHT)
        assert not estimator.contradicts(now, passed, height, 0.0)
    assert not estimator.fault
    assert estimator.speed == pytest.approx(0.0, abs=0.7)
    assert any([estimator.contradicts(now, 0.25, height, 5.0) for _ in range(3)]), "it judges again"


@pytest.mark.parametrize("rest", [0.4, 1.0, 3.0])
def test_a_barometer_is_not_judged_by_a_speed_that_the_thrust_alone_gave(rest):
    """Without sensors for a moment the vehicle touches the ground, where the thrust is no measure of its speed."""
    estimator, now, height, _ = flown(climb=1.0)
    noise = np.random.default_rng(3)
    for _ in range(round(rest / STEP)):
        now += STEP
        estimator.advance(now, STEP, GRAVITY - 3.0, UPRIGHT)  # it stands
    for _ in range(40):
        now += STEP
        estimator.receive_force(now, 0.0, 0.0, -GRAVITY)
        estimator.receive_pressure(now, pressure(30.0 + height + 0.1 * noise.standard_normal()))
        estimator.advance(now, STEP, GRAVITY, UPRIGHT)
    assert not estimator.fault
    assert estimator.has_height(now)
    assert estimator.speed == pytest.approx(0.0, abs=0.4)


def test_an_accelerometer_that_falls_silent_as_the_power_fails_has_not_contradicted_the_thrust():
    estimator, now, _, _ = flown(climb=0.0)
    for _ in range(4):
        now += STEP
        estimator.advance(now, STEP, 0.0, UPRIGHT)
    assert not estimator.fault


def test_late_heights_by_gps_make_little_of_a_speed_that_the_accelerometer_gives():
    """The barometer has jumped, so that it is not used; a speed that follows late heights would make it oscillate."""
    estimator, begin, height, _ = flown(climb=0.0, gps=lambda h: h)
    heights, off = [height] * 31, []
    for step in range(round(30.0 / STEP)):
        now, phase = begin + STEP * (step + 1), 2.0 * math.pi * step * STEP / 8.0
        climb, a = 1.5 * math.sin(phase), 1.5 * 2.0 * math.pi / 8.0 * math.cos(phase)
        heights.append(heights[-1] + STEP * climb)
        estimator.receive_force(now, 0.0, 0.0, -(GRAVITY + a))
        estimator.receive_pressure(now, 0.01 * pressure(30.0 + heights[-1]))
        if step % 4 == 0:
            estimator.receive_gps_height(heights[-31])
        estimator.advance(now, STEP, GRAVITY + a, UPRIGHT)
        off.append(abs(estimator.speed + climb))
    assert max(off[100:]) < 0.8


def test_heights_by_gps_that_have_jumped_make_no_speed_beside_an_accelerometer():
    """GPS reports feet as meters, and then the barometer jumps, so that it is not used: both heights lie."""
    estimator, begin, height, _ = flown(climb=1.5, gps=lambda h: 40.0 + h)
    for step in range(round(12.0 / STEP)):
        now, height = begin + STEP * (step + 1), height + STEP * 1.5
        estimator.receive_force(now, 0.0, 0.0, -GRAVITY)
        estimator.receive_pressure(now, pressure(30.0 + height + (35.0 if step * STEP > 3.0 else 0.0)))
        if step % 4 == 0:
            estimator.receive_gps_height(0.3048 * (40.0 + height))
        estimator.advance(now, STEP, GRAVITY, UPRIGHT)
    assert not estimator.has_height(now)
    assert estimator.speed == pytest.approx(-1.5, abs=0.3)


@pytest.mark.parametrize(("drift", "climb", "used"), [(0.84, 0.3, False), (0.0, -0.5, True)])
def test_a_barometer_far_below_the_ground_and_gps_is_not_used(drift, climb, used):
    """The accelerometer is late, so that who sinks by a barometer that drifts climbs; in a valley both agree."""
    estimator, noise = VerticalSpeedEstimator(), np.random.default_rng(6)
    estimator.receive_pressure(0.0, pressure(30.0))
    estimator.rest()
    for step in range(round(60.0 / STEP)):
        now, height = STEP * step, climb * STEP * step
        estimator.receive_pressure(now, pressure(30.0 + height - drift * now + 0.1 * noise.standard_normal()))
        if step % 4 == 0:
            estimator.receive_gps_height(84.0 + height + noise.standard_normal())
        estimator.advance(now, STEP, GRAVITY, UPRIGHT)
    assert estimator.has_height(now) == used
    assert estimator.speed == pytest.approx(-climb, abs=0.7)
