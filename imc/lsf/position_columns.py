"""The positions in the messages of a log."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from numpy.typing import NDArray


def positions(rows: "NDArray[Any]") -> "NDArray[Any]":
    """WGS-84 positions of rows that have `lat` and `lon` (rad): timestamp (s since 1970 UTC), src, lat, lon, height.

    Angles are in rad and heights above the ellipsoid in m, NaN for messages without a height. Offsets x, y, z (m
    north, east and down of the reference, as in EstimatedState), if there are any, are added. Raises ValueError for
    messages without a position.
    """
    import numpy as np

    from support.wgs84_arrays import displace

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
