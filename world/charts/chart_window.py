"""The part of a chart that is read: a square around the origin of the world."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from support.rotations import wrap
from support.wgs84 import displace
from support.wgs84_arrays import displacement
from world.charts.coordinates import Coordinates
from world.sea import BathymetryError

Floats = NDArray[np.floating[Any]]

MOST_SOUNDINGS = 2_000_000  # of a chart with 1 m from cell to cell, within 700 m; 0.5 GB while it is read
EDGE = 8  # points on each side of the square that are looked up in the coordinates of a chart


class Box(NamedTuple):
    """Limits in the coordinates of a chart."""

    west: float
    south: float
    east: float
    north: float

    def __str__(self) -> str:
        return f"{self.west:.10g} to {self.east:.10g} (x), {self.south:.10g} to {self.north:.10g} (y)"


class ChartWindow(NamedTuple):
    """All that is up to `radius` m north, south, east and west of a latitude and longitude (rad)."""

    latitude: float
    longitude: float
    radius: float

    def __str__(self) -> str:
        return f"{math.degrees(self.latitude):.6g}, {math.degrees(self.longitude):.6g}"

    def boxes(self, coordinates: Coordinates) -> list[Box]:
        """The window in the coordinates of a chart: three in degrees, whose longitudes may count from 0 to 360."""
        side = [self.radius * (2.0 * index / EDGE - 1.0) for index in range(EDGE + 1)]
        ring = [(n, e) for n in side for e in side if self.radius in (abs(n), abs(e))]
        places = [displace(self.latitude, self.longitude, 0.0, n, e)[:2] for n, e in ring]
        east = [wrap(lon - self.longitude) + self.longitude for _, lon in places]
        x, y = coordinates.from_degrees(np.degrees(east), np.degrees([lat for lat, _ in places]))
        turns = (-360.0, 0.0, 360.0) if coordinates.in_degrees else (0.0,)
        box = Box(float(x.min()), float(y.min()), float(x.max()), float(y.max()))
        return [box._replace(west=box.west + turn, east=box.east + turn) for turn in turns]

    def offsets(self, longitude: Floats, latitude: Floats) -> Floats:
        """North and east (2, n) of places (degrees), in m from the middle, to the millimeter.

        Libraries of other versions turn coordinates into degrees with other last digits, on which no run may depend.
        """
        lat, lon = np.radians(latitude), np.radians(longitude)
        north, east, _ = displacement((self.latitude, self.longitude, 0.0), lat, lon, np.zeros(lat.shape))
        return np.round(np.stack((north, east)), 3)

    def raise_if_too_many(self, cells: float) -> None:
        """Raise BathymetryError if the window holds more cells or soundings than can be used."""
        if cells > MOST_SOUNDINGS:
            fits = self.radius * math.sqrt(MOST_SOUNDINGS / cells)
            digit = 10.0 ** math.floor(math.log10(fits))
            rounded = f"{math.floor(fits / digit) * digit:.6f}".rstrip("0").rstrip(".")
            raise BathymetryError(
                f"has {cells:.3g} depths within {self.radius:g} m of the origin, more than {MOST_SOUNDINGS}: "
                f"set Chart Radius to {rounded} or less"
            )

    def raise_outside(self, extents: Sequence[Box], coordinates: Coordinates) -> None:
        """Raise BathymetryError: the chart, which has these extents in its coordinates, has nothing in the window."""
        extent = ", and ".join(str(extent) for extent in extents)
        raise BathymetryError(
            f"has no depth within {self.radius:g} m of the origin {self}: it covers {extent} in {coordinates}; "
            "set [World] Origin to a place of the chart"
        )
