"""Offsets of many WGS-84 positions from one; the equations are those of `imc.coordinates.displacement`."""

from math import cos, sin

import numpy as np

from imc.coordinates import FLATTENING, SEMI_MAJOR_AXIS
from runtime.logs.headers import Array

_E2 = FLATTENING * (2.0 - FLATTENING)


def offsets(origin: tuple[float, float, float], lat: Array, lon: Array, height: Array) -> tuple[Array, Array, Array]:
    """North, east and down (m), in the tangent plane of the origin (rad, rad, m), to positions (rad, rad, m)."""
    places, (start,) = _cartesian(lat, lon, height), _cartesian(*(np.array([value]) for value in origin))
    slat, clat, slon, clon = sin(origin[0]), cos(origin[0]), sin(origin[1]), cos(origin[1])
    north = [-slat * clon, -slat * slon, clat]
    east = [-slon, clon, 0.0]
    down = [-clat * clon, -clat * slon, -slat]
    found = (places - start) @ np.array([north, east, down]).T
    return found[:, 0], found[:, 1], found[:, 2]


def _cartesian(lat: Array, lon: Array, height: Array) -> Array:
    normal = SEMI_MAJOR_AXIS / np.sqrt(1.0 - _E2 * np.sin(lat) ** 2)
    around = (normal + height) * np.cos(lat)
    up = (normal * (1.0 - _E2) + height) * np.sin(lat)
    return np.stack((around * np.cos(lon), around * np.sin(lon), up), axis=-1)
