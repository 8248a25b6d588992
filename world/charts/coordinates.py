"""The coordinates of a chart: longitude and latitude, or a projection of PROJ."""

import importlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from world.sea import BathymetryError

Floats = NDArray[np.floating[Any]]

EXTRA = "pip install 'shoal[charts]'"
WGS84, ETRS89 = 4326, 4258  # EPSG; less than a meter apart


def require_library(name: str, purpose: str) -> Any:
    """A library of the extra `charts`, or a module of it. Raises BathymetryError."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        raise BathymetryError(f"{purpose} needs {error.name or name}: {EXTRA}") from None
    except ImportError as error:  # of a library of the system, which a small container lacks
        raise BathymetryError(f"{purpose} needs {name}, which cannot be loaded: {error}") from None


class Coordinates:
    """Turns x and y of a chart into longitude and latitude (degrees, WGS 84), and back. Heights are left alone.

    `system` is one of rasterio's; None stands for longitude and latitude in degrees, for which no library is needed.
    """

    def __init__(self, system: Any = None):
        self._system: Any = system
        self.in_degrees: bool = system is None or system.to_epsg() in (WGS84, ETRS89)

    def __str__(self) -> str:
        if self.in_degrees:
            return "degrees"
        code = self._system.to_epsg()
        return f"EPSG:{code}" if code else self._system.to_string()[:80]

    def to_degrees(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Longitudes and latitudes (n,); NaN where there are none. Raises BathymetryError."""
        return (x, y) if self.in_degrees else self._transformed(x, y, back=False)

    def from_degrees(self, longitude: Floats, latitude: Floats) -> tuple[Floats, Floats]:
        """x and y (n,). Raises BathymetryError."""
        return (longitude, latitude) if self.in_degrees else self._transformed(longitude, latitude, back=True)

    def _transformed(self, x: Floats, y: Floats, back: bool) -> tuple[Floats, Floats]:
        warp, crs = (require_library(f"rasterio.{name}", f"coordinates in {self}") for name in ("warp", "crs"))
        systems = self._system, crs.CRS.from_epsg(WGS84)
        try:
            found = warp.transform(*(reversed(systems) if back else systems), x.tolist(), y.tolist())
        except Exception as error:
            raise BathymetryError(f"has coordinates in {self}, which cannot be turned into degrees: {error}") from None
        first, second = (np.array(column, np.float64) for column in found[:2])
        if not (np.isfinite(first) & np.isfinite(second)).all():
            raise BathymetryError(f"has coordinates in {self}, which the places of the chart cannot have")
        return first, second


def parse_coordinates(text: str) -> Coordinates:
    """The coordinates with a name, such as EPSG:32629, or a definition. Raises BathymetryError."""
    if text.upper().replace(" ", "") in (f"EPSG:{WGS84}", f"EPSG:{ETRS89}"):
        return Coordinates()
    rasterio, crs = (require_library(name, text) for name in ("rasterio", "rasterio.crs"))
    try:
        with rasterio.Env():  # else PROJ writes to stderr
            return Coordinates(crs.CRS.from_user_input(text))
    except Exception:
        raise BathymetryError(f"{text} is no known system of coordinates, such as EPSG:32629") from None
