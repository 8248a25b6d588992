"""The bottom below a vehicle."""

import math

import pytest

from autonomy.control import BottomEstimator


def test_the_bottom_follows_from_altitude_and_depth_and_stays_where_it_was_seen():
    bottom = BottomEstimator([])
    assert (bottom.depth, bottom.is_known) == (math.inf, False)
    bottom.update(7.0, 3.0, 0.05)
    assert (bottom.depth, bottom.rate, bottom.is_known) == (10.0, 0.0, True)
    bottom.update(6.9, 3.0, 0.05)
    assert (bottom.depth, bottom.rate) == (pytest.approx(9.9), pytest.approx(-2.0))
    bottom.update(6.9, 4.0, 0.05)
    assert bottom.depth == pytest.approx(9.9), "the altitude is an old one"
    for unknown in (-1.0, math.nan, math.inf):
        bottom.update(unknown, 5.0, 0.05)
        assert (bottom.depth, bottom.rate, bottom.is_known) == (pytest.approx(9.9), 0.0, False)
    bottom.update(6.9, 13.1, 0.05)
    assert (bottom.depth, bottom.rate, bottom.is_known) == (20.0, 0.0, True)


def test_the_bottom_is_smoothed():
    bottom = BottomEstimator([1.0, 2.0, 1.0])
    bottom.update(5.0, 5.0, 0.05)
    assert bottom.depth == pytest.approx(10.0)
    bottom.update(9.0, 5.0, 0.05)
    assert bottom.depth == pytest.approx(11.0)
    bottom.update(-1.0, 5.0, 0.05)
    bottom.update(15.0, 5.0, 0.05)
    assert bottom.depth == pytest.approx(20.0), "what was before it was lost does not count"
