"""The area of OperationalLimits is a rectangle that may be turned; without one, every position is inside."""

import math

import pytest

import imc
from imc.coordinates import area_contains
from support.wgs84 import displace

LAT, LON = 0.718, -0.152
AREA = imc.OperationalLimits(
    mask=imc.OpLimitsMask.AREA, lat=LAT, lon=LON, orientation=math.pi / 6, length=200.0, width=40.0
)


@pytest.mark.parametrize(
    ("along", "across", "margin", "inside"),
    [(99.0, 19.0, 0.0, True), (101.0, 0.0, 0.0, False), (0.0, -21.0, 0.0, False), (99.0, 0.0, 2.0, False)],
)
def test_the_sides_are_turned_by_the_orientation(along: float, across: float, margin: float, inside: bool):
    c, s = math.cos(AREA.orientation), math.sin(AREA.orientation)
    lat, lon, _ = displace(LAT, LON, 0.0, c * along - s * across, s * along + c * across)
    assert area_contains(AREA, lat, lon, margin) is inside


def test_limits_without_an_area_contain_everything():
    assert area_contains(AREA.replace(mask=imc.OpLimitsMask.MAX_DEPTH), 0.0, 0.0)


def test_a_position_that_is_not_a_number_is_outside():
    assert not area_contains(AREA, math.nan, LON)
