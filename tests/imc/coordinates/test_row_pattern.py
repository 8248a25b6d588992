"""Parallel rows."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

import imc
from imc.coordinates import altitude_row_spacing, maneuver_corner_offsets, row_corners, sonar_row_spacing


def points(**changes):
    usual = {"bearing": 0.0, "cross_angle": 0.0, "width": 30.0, "length": 100.0, "step": 10.0}
    return [(round(n, 6) + 0.0, round(e, 6) + 0.0) for n, e in row_corners(**{**usual, **changes})]


def test_rows_go_up_and_down():
    assert points() == [(0, 0), (0, 0), (100, 0), (100, 10), (0, 10), (0, 20), (100, 20), (100, 30), (0, 30)]


def test_each_row_ends_beyond_the_area():
    """A corner that is not square leads back to the edge of the area during the step."""
    found = points(width=20.0, overshoot=5.0)
    assert found == [(-5, 0), (0, 0), (105, 0), (100, 10), (-5, 10), (0, 20), (105, 20)]


def test_square_corners():
    found = points(width=20.0, overshoot=5.0, square=True)
    assert found[:6] == [(-5, 0), (0, 0), (105, 0), (105, 10), (100, 10), (-5, 10)]
    assert found[6:] == [(-5, 20), (0, 20), (105, 20)]


def test_alternation_changes_the_steps():
    assert [e for _, e in points(alternation=0.5, width=20.0)] == [0, 0, 0, 5, 5, 20, 20]


def test_without_alternation_each_row_is_flown_twice():
    assert [e for _, e in points(alternation=0.0, width=40.0)] == [0, 0, 0, 0, 0, 20, 20, 20, 20, 40, 40, 40, 40]


def test_side_and_bearing():
    assert points(right=False, width=10.0)[3] == (100, -10)
    assert points(bearing=math.pi / 2, width=10.0)[3] == (-10, 100)


@pytest.mark.parametrize("right", [True, False])
def test_the_cross_angle_turns_the_steps(right):
    """A step keeps its length; both of its ends are nearer to the first corner than at a right angle."""
    side = 1.0 if right else -1.0
    found = points(cross_angle=math.radians(30), width=10.0, right=right)
    across = pytest.approx(side * 10 * math.cos(math.radians(30)), abs=1e-5)
    assert [n for n, _ in found] == [0, 0, 100, 95, -5]
    assert [e for _, e in found] == [0, 0, 0, across, across]
    with pytest.raises(ValueError, match="more than 10000 rows"):
        points(cross_angle=math.pi / 2)


@pytest.mark.parametrize("name", ["width", "length", "step"])
def test_rows_that_are_none(name):
    with pytest.raises(ValueError, match="at least 1 mm"):
        row_corners(**{"bearing": 0, "cross_angle": 0, "width": 1, "length": 1, "step": 1, name: 0.0})


def test_too_many_rows():
    with pytest.raises(ValueError, match="more than 10000 rows"):
        row_corners(bearing=0, cross_angle=0, width=1e6, length=1, step=0.01)


@given(st.floats(0.01, 1000), st.floats(0.01, 1000), st.floats(0.1, 50), st.floats(0, 1), st.booleans(), st.booleans())
def test_rows_stay_within_their_area(width, length, step, alternation, square, right):
    found = row_corners(
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


def test_spacing():
    assert sonar_row_spacing(math.radians(60), 30.0, 0.0) == pytest.approx(30.0)
    assert sonar_row_spacing(math.radians(60), 30.0, 50.0) == pytest.approx(22.5)
    assert sonar_row_spacing(0.0, 30.0, 0.0) == pytest.approx(60.0)
    assert altitude_row_spacing(math.radians(90), 10.0, 50.0) == pytest.approx(15.0)


def test_rows_come_nearer_where_the_swath_is_narrow():
    area = imc.RowsCoverage(width=40, length=100, range=10, flags=imc.RowsCoverage.Flags.CURVE_RIGHT)
    swaths = iter([99.0, 99.0, 10.0, 4.0, 10.0, 99.0])  # two for the check, then one for each step
    found = [round(e, 6) for _, e in maneuver_corner_offsets(area, lambda: next(swaths))]
    assert found == [0, 0, 0, 10, 10, 14, 14, 24, 24]
