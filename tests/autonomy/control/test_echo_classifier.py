"""What an echo from ahead may be."""

import math

import pytest

from autonomy.control import EchoClass, classify_echo


@pytest.mark.parametrize(
    ("reach", "depth", "altitude", "pitch", "wanted"),
    [
        (8.0, 2.0, 3.0, 0.0, EchoClass.OBSTACLE),
        (8.0, 2.0, -1.0, 0.0, EchoClass.OBSTACLE),
        (8.0, 20.0, 60.0, 10.0, EchoClass.OBSTACLE),
        (5.5, 1.39, 2.59, 13.7, EchoClass.SURFACE),  # where DUNE brakes in the mission of tests/data/plans
        (30.0, 0.05, 4.4, 0.0, EchoClass.SURFACE),
        (3.0, 0.1, 4.4, 1.0, EchoClass.SURFACE),
        (8.5, 1.0, 3.1, -15.0, EchoClass.BOTTOM),
        (23.0, 20.0, 2.0, 0.0, EchoClass.BOTTOM),
    ],
)
def test_echoes(reach, depth, altitude, pitch, wanted):
    found = classify_echo(reach, depth, altitude, math.radians(pitch), math.radians(5.0), math.radians(5.0))
    assert found is wanted


def test_a_sonar_in_the_nose_is_higher_than_the_vehicle_when_it_climbs():
    climbing = 0.2, 0.4, -1.0, math.radians(14.5), math.radians(5.0), math.radians(5.0)
    assert classify_echo(*climbing) is EchoClass.OBSTACLE
    assert classify_echo(*climbing, arm=1.0) is EchoClass.SURFACE
