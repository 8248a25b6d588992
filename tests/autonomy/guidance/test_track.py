"""Tracks, and where a vehicle is on one."""

import math

import pytest

from autonomy.guidance import Track, progress


def test_where_a_vehicle_is_on_a_track():
    track = Track((0.0, 0.0), (0.0, 100.0))
    where = progress(track, (-3.0, 40.0), 2.0, 0.5 * math.pi, 0.0)
    assert (where.x, where.y, where.left) == pytest.approx((40.0, 3.0, 60.0))
    assert (where.vx, where.vy) == pytest.approx((2.0, 0.0))
    assert where.eta(5.0, 0.1) == pytest.approx(math.hypot(60.0, 3.0) / 2.0 - 5.0)


def test_a_point_that_is_passed_at_the_side_is_reached():
    where = progress(Track((0.0, 0.0), (100.0, 0.0)), (99.0, 8.0), 1.5, 0.0, 0.0)
    assert where.eta(5.0, 0.1) <= 0.0


@pytest.mark.parametrize(("side", "east"), [(1, -20.0), (-1, 20.0)])
def test_a_circle_is_approached_with_its_center_at_the_inside(side, east):
    tangent = Track((0.0, 0.0), (100.0, 0.0), 20.0, side).circle_entry_track()
    assert tangent.end == pytest.approx((100.0, east))
