"""How long a blind descent lasts, when a state is used again, and when something else carries the vehicle."""

import math

import pytest

from autonomy.control import GRAVITY, BlindDescent, LandingReasons, MultirotorController, PowerDips, TouchdownDetector
from imc import VehicleState
from tests.autonomy.control.test_multirotor_velocity_controller import GAINS

Mode = VehicleState.OpMode


def test_a_state_is_used_after_three_seconds_and_not_after_the_second_descent_within_two_minutes():
    descent = BlindDescent()
    descent.begin(100.0, 20.0)
    assert [descent.trusts(104.0, resumed) for resumed in (100.9, 101.5)] == [True, False]
    descent.begin(150.0, 20.0)
    assert not descent.trusts(1000.0, 200.0)
    descent.forget()
    descent.begin(160.0, 20.0)
    assert descent.trusts(170.0, 165.0)


def test_it_ends_after_a_time_that_depends_on_the_height():
    descent = BlindDescent()
    descent.begin(0.0, 15.0)
    assert [descent.has_landed(now, measured=False) for now in (49.0, 51.0)] == [False, True]
    assert [descent.has_landed(now, measured=True) for now in (89.0, 91.0)] == [False, True]
    descent.note_altitude(30.0)
    assert not descent.has_landed(69.0, measured=False)


def test_a_slow_descent_near_the_ground_has_its_time():
    descent = BlindDescent()
    descent.begin(0.0, 15.0)
    low = {"landing_altitude": 10.0, "landing_rate": 0.1}
    takes = 5.0 / 1.5 + 10.0 / 0.1
    assert [descent.has_landed(now, measured=True, **low) for now in (1.5 * takes, 2.5 * takes)] == [False, True]
    assert descent.has_landed(51.0, measured=False, **low), "it descends at the same rate everywhere"
    assert descent.has_landed(91.0, measured=True, landing_altitude=5.0, landing_rate=0.5)


def test_it_ends_after_a_fall_of_more_than_the_height():
    descent = BlindDescent()
    descent.begin(0.0, 15.0)
    descent.note_fall(1.0, 1.5)
    descent.note_fall(2.0, 11.0)
    assert not descent.has_landed(3.0, measured=False)
    descent.note_fall(1.0, 11.0)
    assert descent.has_landed(4.0, measured=False)


def falls(seconds, **options):
    law = MultirotorController(GAINS)
    return [law.descend_blind(0.1, **options).thrust for _ in range(round(10 * seconds))], law


def test_nothing_makes_it_climb_above_the_fence():
    assert max(falls(3.0, falling=12.0)[0]) > 1.5 * GRAVITY
    assert max(falls(3.0, falling=12.0, above_fence=True)[0]) < 0.85 * GRAVITY


def test_rotors_without_power_let_it_fall_and_then_brake_it_as_hard():
    law = MultirotorController(GAINS)
    law.descend_blind(0.0, lost=0.3)
    assert law.falling == pytest.approx(0.3 * GRAVITY)
    assert law.descend_blind(0.1).thrust > 1.1 * GRAVITY
    _, law = falls(1.5, lost=0.1)
    braking = [law.descend_blind(0.1).thrust for _ in range(60)]
    assert max(braking) > 1.5 * GRAVITY
    assert law.falling == pytest.approx(1.5, abs=0.2)
    assert braking[-1] == pytest.approx(0.98 * GRAVITY, rel=0.02)


@pytest.mark.parametrize(
    ("share", "height", "force", "rests"),
    [
        (0.5, lambda t: 0.0, lambda t: GRAVITY, True),
        (0.5, lambda t: 0.0, lambda t: None, True),
        (0.5, lambda t: None, lambda t: GRAVITY, True),
        (0.5, lambda t: None, lambda t: None, False),
        (0.7, lambda t: 0.0, lambda t: GRAVITY, False),
        (0.5, lambda t: -2.0 * t * t, lambda t: 0.5 * GRAVITY, False),
        (0.5, lambda t: -2.0 * t * t, lambda t: GRAVITY, False),
    ],
)
def test_what_does_not_fall_although_its_rotors_do_not_carry_it_stands(share, height, force, rests):
    detector = TouchdownDetector(PowerDips())
    found = [detector.lies(0.1 * i, share, height(0.1 * i), force(0.1 * i)) for i in range(21)]
    assert any(found) is rests
    assert not any(found[:15])


def test_it_lands_with_a_low_battery_and_where_nothing_leads_it():
    reasons = LandingReasons()
    assert not reasons.find(1e6, 10.0, (60.0, 10.0), hovers=False)
    assert [bool(reasons.find(20.0, 10.0, (60.0, 10.0), hovers=True)) for _ in range(4)] == [False, False, False, True]
    assert not reasons.find(1e6, 10.0, (0.0, 0.0), hovers=True)
    reasons.receive_mode(Mode.MANEUVER)
    assert not reasons.find(1e6, 10.0, (60.0, 10.0), hovers=True)
    reasons.receive_mode(Mode.ERROR)
    assert reasons.find(11.0, 10.0, (60.0, 10.0), hovers=True) == "the vehicle is in error"
    reasons.receive_mode(Mode.SERVICE)
    assert reasons.find(11.0, 10.0, (60.0, 10.0), hovers=True) == "no maneuver after an error"
    reasons.fuel = 9.0
    assert reasons.find(0.0, 10.0, (math.inf, math.inf), hovers=False) == "the battery is low"
