"""A multirotor that stands on the ground."""

import math

import pytest

from autonomy.control import GRAVITY, PowerDips, TouchdownDetector, rotor_actuation

LIGHT, HEAVY = 0.5, 0.9


def found(descent=0.5, vz=0.0, thrust=LIGHT):
    detector = TouchdownDetector(PowerDips())
    return [detector.update(0.25 * i, descent, vz, thrust) for i in range(8)]


def test_a_vehicle_that_rests_for_a_second_stands():
    assert found() == [False] * 4 + [True] * 4


@pytest.mark.parametrize("case", [{"descent": 0.0}, {"vz": 0.3}, {"thrust": HEAVY}, {"vz": math.nan}])
def test_one_that_moves_or_hovers_does_not(case):
    assert not any(found(**case))


def test_a_moment_in_the_air_starts_over():
    detector = TouchdownDetector(PowerDips())
    assert not detector.update(0.0, 0.5, 0.0, LIGHT)
    assert not detector.update(0.5, 0.5, 0.5, LIGHT)
    assert not detector.update(1.0, 0.5, 0.0, LIGHT)
    assert detector.update(2.0, 0.5, 0.0, LIGHT)
    detector.reset()
    assert not detector.update(3.0, 0.5, 0.0, LIGHT)


def test_thrust_grows_with_the_square_of_the_rotor_speed():
    assert rotor_actuation(GRAVITY, 0.7) == 0.7
    assert rotor_actuation(0.25 * GRAVITY, 0.7) == pytest.approx(0.35)
    assert rotor_actuation(9.0 * GRAVITY, 0.7) == 1.0
