"""Positions on the WGS-84 ellipsoid, and offsets north, east and down between them.

Source of the equations: NIMA TR8350.2 (the ellipsoid), Bowring 1976 (Cartesian to geodetic coordinates).
"""

from math import atan2, cos, hypot, pi, sin, sqrt

SEMI_MAJOR_AXIS = 6378137.0  # m
FLATTENING = 1.0 / 298.257223563
_A, _B = SEMI_MAJOR_AXIS, SEMI_MAJOR_AXIS * (1.0 - FLATTENING)
_E2 = FLATTENING * (2.0 - FLATTENING)
_EP2 = _E2 / (1.0 - _E2)


def is_on_earth(lat: float, lon: float) -> bool:
    """Whether numbers are a latitude and a longitude (rad); NaN is none."""
    return abs(lat) <= 0.5 * pi and abs(lon) <= pi


def displace(
    lat: float, lon: float, height: float, north: float, east: float, down: float = 0.0
) -> tuple[float, float, float]:
    """A position (rad, rad, m) displaced by offsets (m) in its tangent plane."""
    x, y, z = _cartesian(lat, lon, height)
    slat, clat, slon, clon = sin(lat), cos(lat), sin(lon), cos(lon)
    outward = -slat * north - clat * down
    x += clon * outward - slon * east
    y += slon * outward + clon * east
    z += clat * north - slat * down
    return _geodetic(x, y, z)


def displacement(
    lat: float, lon: float, height: float, to_lat: float, to_lon: float, to_height: float
) -> tuple[float, float, float]:
    """Offsets north, east and down (m) of the second position (rad, rad, m), in the tangent plane of the first."""
    x, y, z = _cartesian(lat, lon, height)
    tx, ty, tz = _cartesian(to_lat, to_lon, to_height)
    dx, dy, dz = tx - x, ty - y, tz - z
    slat, clat, slon, clon = sin(lat), cos(lat), sin(lon), cos(lon)
    outward = clon * dx + slon * dy
    return -slat * outward + clat * dz, -slon * dx + clon * dy, -clat * outward - slat * dz


def offset(lat: float, lon: float, to_lat: float, to_lon: float) -> tuple[float, float]:
    """Offsets north and east (m) of the second position (rad), both at the surface."""
    north, east, _ = displacement(lat, lon, 0.0, to_lat, to_lon, 0.0)
    return north, east


def ground_distance(lat: float, lon: float, to_lat: float, to_lon: float) -> float:
    """Distance (m) of the second position (rad), both at the surface, in the tangent plane of the first."""
    return hypot(*offset(lat, lon, to_lat, to_lon))


def _cartesian(lat: float, lon: float, height: float) -> tuple[float, float, float]:
    normal = _A / sqrt(1.0 - _E2 * sin(lat) ** 2)
    around = (normal + height) * cos(lat)
    return around * cos(lon), around * sin(lon), (normal * (1.0 - _E2) + height) * sin(lat)


def _geodetic(x: float, y: float, z: float) -> tuple[float, float, float]:
    around = hypot(x, y)
    lat = atan2(z * _A, around * _B * (1.0 - FLATTENING))
    for _ in range(2):  # the second pass makes it exact to rounding at any height a vehicle reaches
        parametric = atan2((1.0 - FLATTENING) * sin(lat), cos(lat))
        lat = atan2(z + _EP2 * _B * sin(parametric) ** 3, around - _E2 * _A * cos(parametric) ** 3)
    slat = sin(lat)
    normal = _A / sqrt(1.0 - _E2 * slat**2)
    height = around * cos(lat) + z * slat - normal * (1.0 - _E2 * slat**2)
    return lat, atan2(y, x), height
