"""Directions in the plane: clockwise from north, and there and back without a change."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.planar_geometry import along_and_across, bearing, north_and_east, remaining_distances

meters, angles = st.floats(-1e5, 1e5), st.floats(-7.0, 7.0)


def test_directions_are_clockwise_from_north():
    assert bearing((1.0, 1.0), (2.0, 1.0)) == 0.0
    assert bearing((1.0, 1.0), (1.0, 2.0)) == math.pi / 2
    assert bearing((0.0, 0.0), (-1.0, 0.0)) == -math.pi  # of the two names of south, the first of [-pi, pi)


def test_starboard_of_east_is_south():
    assert along_and_across(-3.0, 4.0, math.pi / 2) == pytest.approx((4.0, 3.0))
    assert north_and_east(4.0, 3.0, math.pi / 2) == pytest.approx((-3.0, 4.0))


@given(meters, meters, angles)
def test_the_way_back_gives_the_same_offset_and_length(north: float, east: float, direction: float):
    along, across = along_and_across(north, east, direction)
    assert math.hypot(along, across) == pytest.approx(math.hypot(north, east), abs=1e-9)
    assert north_and_east(along, across, direction) == pytest.approx((north, east), abs=1e-9)


def test_distances_that_remain_along_points():
    assert remaining_distances([(0.0, 0.0), (3.0, 4.0), (3.0, 10.0)]) == [11.0, 6.0, 0.0]
    assert remaining_distances([(1.0, 1.0)]) == [0.0]


@given(meters, meters, angles)
def test_a_point_straight_ahead_has_nothing_across(north: float, east: float, direction: float):
    ahead = bearing((north, east), (north + math.cos(direction), east + math.sin(direction)))
    along, across = along_and_across(math.cos(direction), math.sin(direction), ahead)
    assert (along, across) == pytest.approx((1.0, 0.0), abs=1e-6)
