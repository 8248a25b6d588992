"""Positions and offsets of arrays: those of the scalar functions, whatever the type of the columns."""

import numpy as np
import pytest

from support import wgs84, wgs84_arrays

LAT, LON = np.radians([41.185, -33.5, 64.0]), np.radians([-8.704, 151.2, -21.9])
OFFSETS = np.array([[1234.5, -4321.25, 7.5], [10.0, 20.0, -3.0], [-8000.0, 8000.0, 50.0]])


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_columns_of_float32_lose_nothing_more(kind: type) -> None:
    lat, lon, height = LAT.astype(kind), LON.astype(kind), np.array([10, 0, -20], kind)
    there = wgs84_arrays.displace(lat, lon, height, *OFFSETS.T.astype(kind))
    assert all(column.dtype == np.float64 for column in there)
    for row, offset in enumerate(OFFSETS.astype(kind).tolist()):
        start = float(lat[row]), float(lon[row]), float(height[row])
        expected = wgs84.displace(*start, *offset)
        found = tuple(float(column[row]) for column in there)
        assert wgs84.displacement(*expected, *found) == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)


def test_offsets_from_float32_columns_are_those_of_their_values() -> None:
    lat, lon, height = (column.astype(np.float32) for column in (LAT[:1] + 1e-4, LON[:1] - 1e-4, np.array([5.0])))
    origin = (np.float32(LAT[0]), np.float32(LON[0]), np.float32(0.0))
    found = [float(column[0]) for column in wgs84_arrays.displacement(origin, lat, lon, height)]
    places = (*map(float, origin), float(lat[0]), float(lon[0]), float(height[0]))
    assert found == pytest.approx(wgs84.displacement(*places), abs=1e-6)
