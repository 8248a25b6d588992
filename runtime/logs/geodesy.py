"""Positions of whole logs: WGS-84 coordinates as arrays.

Source of the equations: NIMA TR8350.2 (the ellipsoid), Bowring 1976 (the way back from Cartesian coordinates).
"""

import numpy as np

from imc.coordinates import FLATTENING, SEMI_MAJOR_AXIS
from runtime.logs.headers import Array

_A, _B = SEMI_MAJOR_AXIS, SEMI_MAJOR_AXIS * (1.0 - FLATTENING)
_E2 = FLATTENING * (2.0 - FLATTENING)
_EP2 = _E2 / (1.0 - _E2)


def cartesian(lat: Array, lon: Array, height: Array) -> Array:
    """Earth-centred coordinates (m), shape (n, 3), of positions (rad, rad, m)."""
    normal = _A / np.sqrt(1.0 - _E2 * np.sin(lat) ** 2)
    around = (normal + height) * np.cos(lat)
    up = (normal * (1.0 - _E2) + height) * np.sin(lat)
    return np.stack((around * np.cos(lon), around * np.sin(lon), up), axis=-1)


def axes(lat: Array, lon: Array) -> Array:
    """North, east and down in earth-centred coordinates, shape (n, 3, 3): one axis per row."""
    slat, clat, slon, clon = np.sin(lat), np.cos(lat), np.sin(lon), np.cos(lon)
    zero = np.zeros_like(slat)
    north = np.stack((-slat * clon, -slat * slon, clat), axis=-1)
    east = np.stack((-slon, clon, zero), axis=-1)
    down = np.stack((-clat * clon, -clat * slon, -slat), axis=-1)
    return np.stack((north, east, down), axis=-2)


def geodetic(points: Array) -> tuple[Array, Array, Array]:
    """Latitude, longitude (rad) and height (m) of earth-centred coordinates (m), shape (n, 3)."""
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    around = np.hypot(x, y)
    lat = np.arctan2(z * _A, around * _B * (1.0 - FLATTENING))
    for _ in range(2):
        parametric = np.arctan2((1.0 - FLATTENING) * np.sin(lat), np.cos(lat))
        lat = np.arctan2(z + _EP2 * _B * np.sin(parametric) ** 3, around - _E2 * _A * np.cos(parametric) ** 3)
    normal = _A / np.sqrt(1.0 - _E2 * np.sin(lat) ** 2)
    height = around * np.cos(lat) + z * np.sin(lat) - normal * (1.0 - _E2 * np.sin(lat) ** 2)
    return lat, np.arctan2(y, x), height


def where(states: Array) -> Array:
    """Earth-centred coordinates (m), shape (n, 3), of states: their reference positions displaced by their offsets."""
    lat, lon = states["lat"], states["lon"]
    offsets = np.stack([states[name].astype(float) for name in "xyz"], axis=-1)
    return cartesian(lat, lon, states["height"].astype(float)) + np.einsum("nij,ni->nj", axes(lat, lon), offsets)
