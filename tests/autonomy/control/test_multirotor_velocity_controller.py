"""The attitude and thrust of a multirotor that follows a velocity."""

import math
from dataclasses import replace

import pytest

import imc
from autonomy.control import GRAVITY, MultirotorController, MultirotorGains, PIDGains
from support.vectors import norm

GAINS = MultirotorGains(
    horizontal=PIDGains(1.8, 0.0, 0.0),
    vertical=PIDGains(3.0, 1.0, 0.0, integral_limit=0.5),
    position=0.8,
    heading=1.5,
    heading_rate=1.0,
    tilt=0.4,
    acceleration=2.0,
    speed=10.0,
    climb=3.0,
    descent=1.5,
    landing_rate=0.5,
    landing_altitude=5.0,
    thrust=2.04 * GRAVITY,
)
STILL = imc.EstimatedState(z=-10.0, alt=10.0)
NOWHERE = 0.0, 0.0, 0.0


def test_a_vehicle_at_rest_carries_its_weight():
    assert MultirotorController(GAINS).step(STILL, NOWHERE, 0.0, 0.05) == (0.0, 0.0, 0.0, GRAVITY)
    steady = STILL.replace(vx=3.0)
    law = MultirotorController(GAINS)
    for _ in range(100):
        command = law.step(steady, (3.0, 0.0, 0.0), 0.0, 0.05)
    assert command == pytest.approx((0.0, 0.0, 0.0, GRAVITY))


def test_the_reference_changes_no_faster_than_the_vehicle_and_stays_within_its_speeds():
    law = MultirotorController(replace(GAINS, tilt=1.0))
    north = law.step(STILL, (30.0, 0.0, 0.0), 0.0, 0.1)
    assert law.velocity == (10.0, 0.0, 0.0)
    acceleration = 2.0 + 1.8 * 0.2  # that of the reference, and what it is ahead
    assert north.pitch == pytest.approx(-math.atan(acceleration / GRAVITY))
    law.step(STILL, (0.0, 0.0, -9.0), 0.0, 0.1)
    assert law.velocity == (0.0, 0.0, -3.0)
    law.step(STILL, (0.0, 0.0, 9.0), 0.0, 0.1)
    assert law.velocity == (0.0, 0.0, 1.5)


def test_the_tilt_is_limited():
    assert MultirotorController(GAINS).step(STILL.replace(vx=20.0), NOWHERE, 0.0, 0.1).pitch == pytest.approx(0.4)


def test_headings_turn_the_short_way_and_no_faster_than_allowed():
    law, west = MultirotorController(GAINS), STILL.replace(psi=math.radians(175.0))
    assert law.step(west, NOWHERE, math.radians(-175.0), 0.05).heading_rate == pytest.approx(1.5 * math.radians(10.0))
    assert law.step(STILL, NOWHERE, 2.0, 0.05).heading_rate == 1.0


def test_integrals_stay_within_their_limit():
    law = MultirotorController(GAINS)
    for _ in range(200):
        command = law.step(STILL.replace(vz=0.1), NOWHERE, 0.0, 0.1)
    assert command.thrust == pytest.approx(GRAVITY + 0.3 + 0.5)
    law.reset()
    assert law.step(STILL, NOWHERE, 0.0, 0.1).thrust == GRAVITY


def test_a_point_is_held_and_landed_on():
    law, away = MultirotorController(GAINS), STILL.replace(x=1.0)
    assert law.position_hold_velocity(away, (0.0, 2.0, -11.0)) == pytest.approx((-0.8, 1.6, -0.8))
    assert law.landing_velocity(away, (0.0, 0.0, -10.0)) == pytest.approx((-0.8, 0.0, 1.5))
    assert law.landing_velocity(away.replace(alt=4.0), (0.0, 0.0, -10.0)) == pytest.approx((-0.8, 0.0, 0.5))
    assert law.stopping_point(STILL) == (0.0, 0.0, -10.0)
    assert law.stopping_point(STILL.replace(vx=4.0)) == pytest.approx((4.0 * 1.3, 0.0, -10.0))


def test_what_is_not_a_number_is_not_hidden():
    assert math.isnan(norm(MultirotorController(GAINS).step(STILL, (math.nan, 0.0, 0.0), 0.0, 0.1)[:3]))


def test_without_a_state_it_descends_level_with_the_weight_that_it_learned():
    law = MultirotorController(GAINS)
    law.falling = 1.5
    assert law.descend_blind(0.1) == pytest.approx((0.0, 0.0, 0.0, 0.98 * GRAVITY))
    law.falling = -9.0
    assert law.descend_blind(0.1).thrust == pytest.approx(0.98 * GRAVITY - 2.0)
    assert law.falling == pytest.approx(-8.8)
    for _ in range(200):  # it needs less thrust than gravity
        law.step(STILL.replace(vz=-0.1), NOWHERE, 0.0, 0.1)
    law.falling = 1.5
    assert law.descend_blind(0.1).thrust == pytest.approx(0.98 * (GRAVITY - 0.5), abs=0.05)


def test_a_blind_descent_follows_the_speed_that_is_measured():
    law = MultirotorController(GAINS)
    assert law.descend_blind(0.1, 1.5).thrust == pytest.approx(GRAVITY)
    assert law.descend_blind(0.1, 2.0).thrust == pytest.approx(GRAVITY + 2.0)
    assert law.descend_blind(0.1, -20.0).thrust == pytest.approx(0.3 * GRAVITY), "it does not stop the rotors"


def test_the_weight_is_that_which_the_accelerometer_confirms():
    def learned(force):
        law = MultirotorController(GAINS)
        for _ in range(600):
            law.step(STILL, NOWHERE, 0.0, 0.05, force=force)
        return law.weight / GRAVITY

    assert learned(GRAVITY / 1.1) == pytest.approx(1.1)
    assert learned(3.0 * GRAVITY) == 1.0, "it contradicts the integral"


def test_a_load_that_is_lost_is_learned_at_once_but_not_on_the_ground():
    law = MultirotorController(GAINS)
    law.step(STILL, NOWHERE, 0.0, 0.05)
    for _ in range(20):
        law.update_load(0.05, 1.5 * GRAVITY)
    assert law.weight == pytest.approx(GRAVITY / 1.5, rel=0.15)
    law.reset()
    for _ in range(20):
        law.update_load(0.05, GRAVITY)
    law.update_load(0.05, None)
    assert law.weight == GRAVITY


def test_a_fence_slows_a_climb_and_brings_back_what_is_above():
    law = MultirotorController(GAINS)
    assert law.below_fence((1.0, 2.0, -3.0), 100.0) == (1.0, 2.0, -3.0)
    assert law.below_fence((1.0, 2.0, -3.0), 2.0) == pytest.approx((1.0, 2.0, -1.6))
    assert law.below_fence((1.0, 2.0, -3.0), -2.0) == pytest.approx((1.0, 2.0, 1.6))
    assert law.below_fence((1.0, 2.0, 3.0), -2.0) == (1.0, 2.0, 3.0)
    assert law.below_fence((0.0, 0.0, -3.0), math.inf) == (0.0, 0.0, -3.0)
