"""Lines and circles in space."""

import pytest

from autonomy.guidance import Circle, Line, MotionLimits
from support.vectors import norm

PACE = MotionLimits(speed=5.0, climb=2.0, descent=1.0, acceleration=2.0, gain=0.8)


def test_a_point_is_approached_no_faster_than_it_can_be_braked_for():
    for distance in (0.1, 1.0, 3.0, 10.0, 50.0):
        speed, nearer = PACE.approach_speed(distance), PACE.approach_speed(distance - 1e-4)
        assert speed * (speed - nearer) / 1e-4 <= PACE.acceleration * 1.001  # v dv/ds
    assert PACE.velocity_to((3.0, 4.0, 0.0)) == pytest.approx(
        tuple(PACE.approach_speed(5.0) / 5.0 * v for v in (3.0, 4.0, 0.0))
    )
    assert norm(PACE.velocity_to((300.0, 400.0, 0.0))) == pytest.approx(5.0)


def test_a_line_is_followed_and_come_back_to():
    line = Line((0.0, 0.0, 0.0), (100.0, 0.0, 0.0))
    assert line.velocity((50.0, 0.0, 0.0), PACE) == pytest.approx((5.0, 0.0, 0.0))
    north, east, down = line.velocity((50.0, 2.0, -1.0), PACE)
    assert north > 4.0
    assert east < -1.0
    assert down > 0.5
    assert line.velocity((100.0, 0.0, 0.0), PACE) == pytest.approx((0.0, 0.0, 0.0))
    assert line.velocity((105.0, 0.0, 0.0), PACE)[0] < -2.0
    assert (line.distance_to_end((40.0, 3.0, 0.0)), line.cross_track_distance((40.0, 3.0, 0.0))) == pytest.approx(
        (60.0, 3.0)
    )


def test_a_steep_line_is_as_fast_as_it_may_climb():
    north, _, down = Line((0.0, 0.0, 0.0), (30.0, 0.0, -60.0)).velocity((10.0, 0.0, -20.0), PACE)
    assert (north, down) == pytest.approx((1.0, -2.0))


@pytest.mark.parametrize("side", [1, -1])
def test_a_circle_is_gone_around(side):
    circle = Circle((0.0, 0.0, -10.0), 20.0, side)
    north, east, down = circle.velocity((20.0, 0.0, -10.0), PACE)
    assert (north, east, down) == pytest.approx((0.0, side * 5.0, 0.0))
    outer, inner = circle.velocity((25.0, 0.0, -10.0), PACE), circle.velocity((15.0, 0.0, -10.0), PACE)
    assert outer[0] < 0.0 < inner[0]
    assert norm(outer) == pytest.approx(5.0)
    assert norm(Circle((0.0, 0.0, 0.0), 2.0).velocity((2.0, 0.0, 0.0), PACE)) == pytest.approx(2.0)
