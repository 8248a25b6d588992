"""`displace` and `displacement` for arrays of positions; the equations are those of `support.wgs84`.

All is computed in float64, whatever the columns are: in float32, a place on Earth is only known to half a meter.
"""

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from support.wgs84 import FLATTENING, SEMI_MAJOR_AXIS

Array: TypeAlias = NDArray[Any]

_A, _B = SEMI_MAJOR_AXIS, SEMI_MAJOR_AXIS * (1.0 - FLATTENING)
_E2 = FLATTENING * (2.0 - FLATTENING)
_EP2 = _E2 / (1.0 - _E2)


def displace(
    lat: Array, lon: Array, height: Array, north: Array, east: Array, down: Array
) -> tuple[Array, Array, Array]:
    """Positions (rad, rad, m) displaced by offsets (m), each in the tangent plane of its own position."""
    lat, lon, height, north, east, down = map(_exact, (lat, lon, height, north, east, down))
    slat, clat, slon, clon = np.sin(lat), np.cos(lat), np.sin(lon), np.cos(lon)
    normal = _A / np.sqrt(1.0 - _E2 * slat**2)
    outward = -slat * north - clat * down
    x = (normal + height) * clat * clon + clon * outward - slon * east
    y = (normal + height) * clat * slon + slon * outward + clon * east
    z = (normal * (1.0 - _E2) + height) * slat + clat * north - slat * down

    around = np.hypot(x, y)
    lat = np.arctan2(z * _A, around * _B * (1.0 - FLATTENING))
    for _ in range(2):
        parametric = np.arctan2((1.0 - FLATTENING) * np.sin(lat), np.cos(lat))
        lat = np.arctan2(z + _EP2 * _B * np.sin(parametric) ** 3, around - _E2 * _A * np.cos(parametric) ** 3)
    slat = np.sin(lat)
    normal = _A / np.sqrt(1.0 - _E2 * slat**2)
    height = around * np.cos(lat) + z * slat - normal * (1.0 - _E2 * slat**2)
    return lat, np.arctan2(y, x), height


def displacement(
    origin: tuple[float, float, float], lat: Array, lon: Array, height: Array
) -> tuple[Array, Array, Array]:
    """Offsets north, east and down (m) of positions (rad, rad, m), in the tangent plane of the origin (rad, rad, m)."""
    origin = float(origin[0]), float(origin[1]), float(origin[2])
    places, (start,) = _cartesian(lat, lon, height), _cartesian(*(np.array([value]) for value in origin))
    slat, clat, slon, clon = np.sin(origin[0]), np.cos(origin[0]), np.sin(origin[1]), np.cos(origin[1])
    north = [-slat * clon, -slat * slon, clat]
    east = [-slon, clon, 0.0]
    down = [-clat * clon, -clat * slon, -slat]
    found = (places - start) @ np.array([north, east, down]).T
    return found[:, 0], found[:, 1], found[:, 2]


def _cartesian(lat: Array, lon: Array, height: Array) -> Array:
    lat, lon, height = map(_exact, (lat, lon, height))
    normal = _A / np.sqrt(1.0 - _E2 * np.sin(lat) ** 2)
    around = (normal + height) * np.cos(lat)
    up = (normal * (1.0 - _E2) + height) * np.sin(lat)
    return np.stack((around * np.cos(lon), around * np.sin(lon), up), axis=-1)


def _exact(values: Array) -> Array:
    return np.asarray(values, np.float64)
