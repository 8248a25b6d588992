"""Vectors north, east, down as tuples, and numbers that are limited."""

import math

import pytest

from support.number_parsing import clamp_magnitude
from support.vectors import add, dot, limit_horizontal_and_vertical, norm


def test_sums_products_and_lengths():
    assert add((1.0, 2.0, 3.0), (1.0, 0.0, -1.0), 2.0) == (3.0, 2.0, 1.0)
    assert dot((1.0, 2.0, 3.0), (4.0, 5.0, 6.0)) == 32.0
    assert norm((2.0, 3.0, 6.0)) == 7.0


def test_a_velocity_keeps_its_direction_over_ground():
    assert limit_horizontal_and_vertical((3.0, 4.0, 9.0), 2.5, 1.0, 2.0) == pytest.approx((1.5, 2.0, 2.0))
    assert limit_horizontal_and_vertical((0.0, 0.0, -9.0), 2.5, 1.0, 2.0) == (0.0, 0.0, -1.0)
    assert limit_horizontal_and_vertical((1.0, 1.0, 0.5), 2.5, 1.0, 2.0) == (1.0, 1.0, 0.5)


def test_numbers_are_limited_on_both_sides():
    assert [clamp_magnitude(value, 2.0) for value in (-3.0, 1.0, 3.0)] == [-2.0, 1.0, 2.0]
    assert math.isnan(clamp_magnitude(math.nan, 2.0))
