"""What the samples of a depth sensor say of a vehicle."""

import pytest

from autonomy.control import DepthCondition, MeasuredDepth


def sampled(depth, seconds, deepest=50.0):
    """The depth after samples of `depth` (m, of the time) at 10 Hz."""
    measured = MeasuredDepth()
    for tick in range(round(10 * seconds)):
        measured.update(0.1 * tick, depth(0.1 * tick), deepest)
    return measured


def test_a_depth_is_too_deep_when_all_samples_of_a_second_are():
    assert sampled(lambda t: 51.0, 1.2).is_too_deep
    assert not sampled(lambda t: 51.0, 0.9).is_too_deep
    assert not sampled(lambda t: 51.0 if t < 4.95 or t > 5.05 else 5.0, 5.5).is_too_deep
    assert sampled(lambda t: 1.5 * t, 32.0).is_too_deep, "it coasts beyond the limit"
    assert not sampled(lambda t: 0.3 * t, 160.0).is_too_deep


def test_a_rate_is_that_of_the_motion_and_not_of_a_jump():
    measured = sampled(lambda t: 20.0 - 0.5 * t if t < 10.0 else 5.0 - 0.5 * t, 12.0)
    assert measured.rising == pytest.approx(0.5, abs=0.15)
    assert measured.jumped_up == pytest.approx(15.0, abs=0.1)
    assert sampled(lambda t: 20.0 + 2.0 * t, 5.0).jumped_up == 0.0


def test_a_condition_that_one_sample_does_not_meet_begins_again():
    condition = DepthCondition()
    met = [condition.update(0.25 * tick, tick != 6) for tick in range(14)]
    assert met == [tick in (4, 5) or tick >= 11 for tick in range(14)]
