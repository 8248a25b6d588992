"""Positions and offsets on the ellipsoid, compared with imcpy and with their inverses."""

import math

import imcpy
import pytest
from hypothesis import given
from hypothesis import strategies as st

import imc
from imc import coordinates
from support import wgs84

LATITUDES = st.floats(-1.5, 1.5)
LONGITUDES = st.floats(-3.1, 3.1)
OFFSETS = st.floats(-5000.0, 5000.0)


@given(LATITUDES, LONGITUDES, st.floats(-200.0, 1000.0), OFFSETS, OFFSETS, st.floats(-500.0, 500.0))
def test_offsets_return(lat: float, lon: float, height: float, north: float, east: float, down: float) -> None:
    there = wgs84.displace(lat, lon, height, north, east, down)
    assert wgs84.displacement(lat, lon, height, *there) == pytest.approx((north, east, down), abs=1e-6)


@given(LATITUDES, LONGITUDES, st.floats(-0.001, 0.001), st.floats(-0.001, 0.001), st.floats(-100.0, 100.0))
def test_displacement_is_imcpys(lat: float, lon: float, further: float, aside: float, height: float) -> None:
    places = (lat, lon, 10.0, lat + further, lon + aside, height)
    assert wgs84.displacement(*places) == pytest.approx(imcpy.coordinates.WGS84.displacement(*places), abs=1e-4)


@given(LATITUDES, LONGITUDES, OFFSETS, OFFSETS)
def test_displace_is_imcpys_but_for_its_tilt(lat: float, lon: float, north: float, east: float) -> None:
    """DUNE turns the offsets by the geocentric latitude, up to 0.19° from the ellipsoid's vertical: 6e-6 of them."""
    there = wgs84.displace(lat, lon, 0.0, north, east)
    theirs = imcpy.coordinates.WGS84.displace(lat, lon, north, east)
    apart = wgs84.displacement(*theirs, 0.0, *there[:2], 0.0)
    assert math.hypot(*apart) < 1e-3 + 1e-5 * math.hypot(north, east)


def test_absolute() -> None:
    state = imc.EstimatedState(lat=0.7, lon=-0.15, height=10.0, x=100.0, y=-50.0, z=3.0)
    lat, lon, height = coordinates.absolute_position(state)
    assert wgs84.displacement(0.7, -0.15, 10.0, lat, lon, height) == pytest.approx((100.0, -50.0, 3.0), abs=1e-6)


def test_known_place() -> None:
    """One minute of latitude at the equator is 1842.9 m on WGS-84, at the pole 1861.6 m."""
    minute = math.radians(1 / 60)
    for lat, length in ((0.0, 1842.9), (math.pi / 2 - minute, 1861.6)):
        north, east, _ = wgs84.displacement(lat, 0.0, 0.0, lat + minute, 0.0, 0.0)
        assert (north, east) == (pytest.approx(length, abs=0.05), pytest.approx(0.0, abs=1e-6))


def test_what_is_a_place_on_earth() -> None:
    assert wgs84.is_on_earth(-0.5 * math.pi, math.radians(180.0))
    for lat, lon in ((1.6, 0.0), (0.0, 3.2), (math.nan, 0.0), (0.0, math.nan), (0.0, -math.inf)):
        assert not wgs84.is_on_earth(lat, lon)
