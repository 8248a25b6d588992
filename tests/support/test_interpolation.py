"""Linear interpolation in a table, and beyond its ends."""

import pytest

from support.interpolation import interpolate


@pytest.mark.parametrize(
    ("x", "expected"), [(0.0, 10.0), (0.5, 15.0), (1.0, 20.0), (2.0, 40.0), (-1.0, 0.0), (4.0, 80.0)]
)
def test_values_between_and_beyond_the_points(x, expected):
    assert interpolate(x, [0.0, 1.0, 3.0], [10.0, 20.0, 60.0]) == pytest.approx(expected)
