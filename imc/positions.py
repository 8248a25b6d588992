"""Positions of many messages at once; the equations are those of `imc.coordinates`."""

from typing import TYPE_CHECKING, Any

from imc.coordinates import FLATTENING, SEMI_MAJOR_AXIS

if TYPE_CHECKING:
    from numpy.typing import NDArray

_A, _B = SEMI_MAJOR_AXIS, SEMI_MAJOR_AXIS * (1.0 - FLATTENING)
_E2 = FLATTENING * (2.0 - FLATTENING)
_EP2 = _E2 / (1.0 - _E2)


def positions(rows: "NDArray[Any]") -> "NDArray[Any]":
    """WGS-84 positions of rows that have `lat` and `lon` (rad): timestamp (s since 1970 UTC), src, lat, lon, height.

    Angles are in rad and heights above the ellipsoid in m, NaN for messages without a height. Where there are offsets
    x, y, z as well (m north, east and down of the reference, as in EstimatedState), these are added. Raises ValueError
    for messages that have no position.
    """
    import numpy as np

    names = set(rows.dtype.names or ())
    if not {"lat", "lon"} <= names:
        raise ValueError(f"no lat and lon among {', '.join(rows.dtype.names or ('nothing',))}")
    lat, lon = rows["lat"].astype(np.float64), rows["lon"].astype(np.float64)
    height = rows["height"].astype(np.float64) if "height" in names else np.full(rows.size, np.nan)
    if {"x", "y", "z", "height"} <= names:
        lat, lon, height = displace(lat, lon, height, *(rows[name].astype(np.float64) for name in "xyz"))
    kinds = [("timestamp", "f8"), ("src", "u2"), ("lat", "f8"), ("lon", "f8"), ("height", "f8")]
    found = np.empty(rows.size, kinds)
    columns = rows["timestamp"], rows["src"], lat, lon, height
    for (name, _), column in zip(kinds, columns, strict=True):
        found[name] = column
    return found


def displace(
    lat: "NDArray[Any]",
    lon: "NDArray[Any]",
    height: "NDArray[Any]",
    north: "NDArray[Any]",
    east: "NDArray[Any]",
    down: "NDArray[Any]",
) -> tuple["NDArray[Any]", "NDArray[Any]", "NDArray[Any]"]:
    """The positions (rad, rad, m) at offsets (m) from others, as `imc.coordinates.displace` gives each of them."""
    import numpy as np

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
