"""The Earth's magnetic field as a vehicle turns in it, and what iron does to it."""

import math

import pytest

from world.sensors import Magnetometer

STRENGTH, DECLINATION, INCLINATION = 0.45, math.radians(-1.5), math.radians(54.5)


def test_a_level_vehicle_that_points_to_magnetic_north_has_the_field_ahead_and_down():
    x, y, z = Magnetometer(STRENGTH, DECLINATION, INCLINATION).measure(0.0, 0.0, DECLINATION)
    assert (x, y, z) == pytest.approx((STRENGTH * math.cos(INCLINATION), 0.0, STRENGTH * math.sin(INCLINATION)))


def test_a_vehicle_that_points_east_has_it_to_port_and_one_on_its_side_to_starboard():
    east = Magnetometer(STRENGTH, 0.0, INCLINATION).measure(0.0, 0.0, math.pi / 2)
    assert east == pytest.approx((0.0, -STRENGTH * math.cos(INCLINATION), STRENGTH * math.sin(INCLINATION)))
    side = Magnetometer(STRENGTH, 0.0, math.pi / 2).measure(math.pi / 2, 0.0, 0.3)
    assert side == pytest.approx((0.0, STRENGTH, 0.0), abs=1e-12)


def test_iron_moves_and_bends_the_circle():
    soft = (1.1, 0.02, 0.0, 0.02, 0.95, 0.0, 0.0, 0.0, 1.0)
    plain = Magnetometer(STRENGTH, DECLINATION, INCLINATION)
    bent = Magnetometer(STRENGTH, DECLINATION, INCLINATION, (0.03, -0.02, 0.01), soft)
    for heading in (0.0, 1.0, 2.5, 4.0):
        x, y, z = plain.measure(0.1, -0.2, heading)
        expected = (1.1 * x + 0.02 * y + 0.03, 0.02 * x + 0.95 * y - 0.02, z + 0.01)
        assert bent.measure(0.1, -0.2, heading) == pytest.approx(expected)
