"""Parallel rows."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from imc.coordinates import rows, swath


def points(**changes):
    usual = {"bearing": 0.0, "cross_angle": 0.0, "width": 30.0, "length": 100.0, "step": 10.0}
    return [(round(n, 6) + 0.0, round(e, 6) + 0.0) for n, e in rows(**{**usual, **changes})]


def test_rows_go_up_and_down():
    assert points() == [(0, 0), (0, 0), (100, 0), (100, 10), (0, 10), (0, 20), (100, 20), (100, 30), (0, 30)]


def test_overshoot_and_square_corners():
    assert points(width=10.0, overshoot=5.0)[:3] == [(-5, 0), (0, 0), (100, 0)]
    corners = [(-5, 0), (0, 0), (105, 0), (105, 10), (100, 10), (-5, 10)]
    assert points(width=10.0, overshoot=5.0, square=True) == corners


def test_alternation_changes_the_steps():
    assert [e for _, e in points(alternation=0.5, width=20.0)] == [0, 0, 0, 5, 5, 20, 20]


def test_side_bearing_and_lean():
    assert points(right=False, width=10.0)[3] == (100, -10)
    assert points(bearing=math.pi / 2, width=10.0)[3] == (-10, 100)
    assert points(cross_angle=math.pi / 4, width=10.0)[3] == (110, 10)


@pytest.mark.parametrize("name", ["width", "length", "step"])
def test_rows_that_are_none(name):
    with pytest.raises(ValueError, match="at least 1 mm"):
        rows(**{"bearing": 0, "cross_angle": 0, "width": 1, "length": 1, "step": 1, name: 0.0})


def test_too_many_rows():
    with pytest.raises(ValueError, match="more than 10000 rows"):
        rows(bearing=0, cross_angle=0, width=1e6, length=1, step=0.01)


@given(st.floats(0.01, 1000), st.floats(0.01, 1000), st.floats(0.1, 50), st.floats(0, 1), st.booleans(), st.booleans())
def test_rows_stay_within_their_area(width, length, step, alternation, square, right):
    found = rows(
        bearing=0,
        cross_angle=0,
        width=width,
        length=length,
        step=step,
        alternation=alternation,
        square=square,
        right=right,
    )
    sides = [e if right else -e for _, e in found]
    assert -1e-9 <= min(sides) <= max(sides) <= width + 1e-6
    assert {round(n, 9) for n, _ in found} <= {0.0, round(length, 9)}


def test_swath():
    assert swath(math.radians(60), 30.0, 0.0) == pytest.approx(30.0)
    assert swath(-math.radians(60), 30.0, 0.5) == pytest.approx(15.0)
