"""Attitudes that are impossible in radians."""

import math

import pytest

from autonomy.navigation import AttitudeRange


def judged(angles, rate=50.0):
    check = AttitudeRange()
    return [check.accepts(i / rate, *each) for i, each in enumerate(angles)], check


@pytest.mark.parametrize("odd", [(1.6, 0.0, 0.0), (0.0, -1.57, 0.0), (0.0, 0.0, 90.0), (math.nan, 0.0, 0.0)])
def test_one_impossible_attitude_is_rejected_alone(odd):
    found, check = judged([(0.0, 0.1, 6.2), odd, (0.0, 0.1, -3.1)])
    assert found == [True, False, True]
    assert not check.rejects(0.1)


def test_after_several_all_are_rejected_for_three_seconds():
    found, check = judged([(0.0, 2.0, 0.0)] * 3 + [(0.0, 0.1, 0.0)] * 200)
    assert found.index(True) == pytest.approx(3.0 * 50.0 + 3, abs=2)
    assert all(found[found.index(True) :])
    assert check.rejects(1.0)
    assert not check.rejects(3.5)


def test_single_ones_that_come_again_and_again_are_no_several():
    found, check = judged(([(0.0, 2.0, 0.0)] + [(0.0, 0.1, 0.0)] * 44) * 20)
    assert found == ([False] + [True] * 44) * 20
    assert not check.rejects(18.0)


def test_those_that_are_no_number_say_nothing_about_the_others():
    found, check = judged([(0.0, math.nan, 0.0), (math.inf, 0.0, 0.0), (0.0, 0.1, 0.0)] * 20)
    assert found == [False, False, True] * 20
    assert not check.rejects(1.0)


def test_each_vehicle_has_its_own_range():
    check = AttitudeRange(largest_roll=3.2, largest_pitch=1.6)
    assert check.accepts(0.0, 3.1, -1.5, 0.0)
    assert not check.accepts(0.1, 0.0, 1.7, 0.0)
