"""The attitude and thrust of an acceleration."""

import math

import pytest

from autonomy.control import GRAVITY, tilt_and_thrust
from support.rotations import rotation, to_ned


@pytest.mark.parametrize("psi", [0.0, 1.0, -2.5])
@pytest.mark.parametrize("wanted", [(0.0, 0.0, 0.0), (2.0, -1.0, 0.5), (-1.0, 3.0, -2.0)])
def test_thrust_along_the_mast_gives_the_acceleration(wanted, psi):
    roll, pitch, thrust = tilt_and_thrust(wanted, psi, math.radians(40.0))
    north, east, down = to_ned(rotation(roll, pitch, psi), (0.0, 0.0, -thrust))
    assert (north, east, down + GRAVITY) == pytest.approx(wanted)


def test_the_tilt_is_the_arc_tangent_of_acceleration_over_gravity_up_to_its_limit():
    roll, pitch, thrust = tilt_and_thrust((2.0, 0.0, 0.0), 0.0, math.radians(40.0))
    assert (roll, pitch) == pytest.approx((0.0, -math.atan(2.0 / GRAVITY)))
    assert thrust == pytest.approx(math.hypot(2.0, GRAVITY))
    assert tilt_and_thrust((50.0, 0.0, 0.0), 0.0, 0.4)[1] == pytest.approx(-0.4)
    assert tilt_and_thrust((0.0, 0.0, 50.0), 0.0, 0.4)[2] == pytest.approx(0.3 * GRAVITY)
