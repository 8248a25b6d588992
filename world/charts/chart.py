"""A chart: the depths in a file of the field, around the origin of the world."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from support.number_parsing import is_number
from world.charts.chart_cells import ChartCells, Positive
from world.charts.chart_window import ChartWindow
from world.charts.coordinates import Coordinates
from world.charts.netcdf_files import read_netcdf
from world.charts.raster_files import read_geotiff
from world.charts.text_files import read_text
from world.sea import Bathymetry, BathymetryError

Floats = NDArray[np.floating[Any]]
Read = Callable[[Path, ChartWindow, Coordinates | None], ChartCells]

FORMATS: Mapping[str, tuple[Read, str]] = MappingProxyType(
    {
        ".tif": (read_geotiff, "GeoTIFF"),
        ".tiff": (read_geotiff, "GeoTIFF"),
        ".nc": (read_netcdf, "NetCDF"),
        ".nc4": (read_netcdf, "NetCDF"),
        ".asc": (read_text, "ESRI grid or soundings"),
        ".xyz": (read_text, "soundings"),
        ".csv": (read_text, "soundings"),
        ".txt": (read_text, "soundings"),
    }
)
POSITIVE = ("", "up", "down")
SAMPLES = 41  # in a row and in a column, of places whose depths may be unknown
REACH = 2.0  # cells of a grid, from which a depth is computed
FARTHEST_VALUE = 11_500.0  # m; no sea is deeper, no mountain higher
USUAL_FILL = (-9999.0, 9999.0)


@dataclass(frozen=True, eq=False)
class Chart:
    """Soundings (3, n): north, east and depth (m), up to `reach` m from an origin.

    `radius` (m) is that within which each counts; those of a file without a grid are `scattered`.
    """

    name: str
    soundings: Floats
    radius: float
    reach: float
    scattered: bool

    def sounding_radius(self, given: float | None) -> float:
        """The radius (m) within which each sounding counts: an option counts for scattered ones, within limits."""
        return self.radius if given is None or not self.scattered else min(max(given, self.radius), 4.0 * self.radius)

    def describe(self) -> str:
        """The depths that were read, in one line."""
        depths = self.soundings[2]
        return (
            f"the bottom is that of {self.name}: {depths.size} depths of {depths.min():.1f} to {depths.max():.1f} m "
            f"within {self.reach:g} m of the origin"
        )

    def describe_gaps(self, seabed: Bathymetry) -> str:
        """The share of the window without depth, in one line; empty if each place has one."""
        side = np.linspace(-self.reach, self.reach, SAMPLES).tolist()
        unknown = sum(not seabed.is_known(north, east) for north in side for east in side)  # integers
        if not unknown:
            return ""
        share = max(1, round(100.0 * unknown / SAMPLES**2))
        return (
            f"{self.name} has no depths for {share} % of the {2.0 * self.reach:g} m x {2.0 * self.reach:g} m around "
            f"the origin: there the bottom is at Out Of Bounds Depth, {seabed.default_depth:g} m"
        )


def find_chart_suffix(text: str) -> str:
    """The suffix of the name of a file, such as .tif; empty for a row of numbers."""
    suffix = Path(text).suffix.lower()
    return suffix if suffix[1:2].isalpha() and not all(map(is_number, text.replace(",", " ").split())) else ""


def read_chart(path: Path, window: ChartWindow, coordinates: Coordinates | None = None, positive: str = "") -> Chart:
    """Read a chart, of which only what is in the window gets into memory. Raises BathymetryError.

    `coordinates` are those of a file that does not name its own, `positive` is the direction in which its values
    increase, "up" or "down", where that must be given.
    """
    if (found := FORMATS.get(path.suffix.lower())) is None:
        known = ", ".join(f"{suffix} ({name})" for suffix, (_, name) in FORMATS.items())
        raise BathymetryError(f"is in no known format; the known ones: {known}")
    if not path.exists():
        raise BathymetryError("is not there: neither beside the profile, nor in the working folder")
    if not path.is_file():
        raise BathymetryError("is not a file")
    cells = found[0](path, window, coordinates)
    has_depth = np.isfinite(cells.values)
    if not has_depth.any():
        raise BathymetryError(f"has no depth within {window.radius:g} m of the origin {window}: all cells are empty")
    _raise_undeclared_fill(cells.values[has_depth])
    values = cells.values[has_depth]
    depths = values if _direction(cells, values, positive) == "down" else -values
    if (depths <= 0.0).all():
        raise BathymetryError(
            f"has no water within {window.radius:g} m of the origin {window}: should Chart Positive be the other way?"
        )
    places = window.offsets(cells.longitude[has_depth], cells.latitude[has_depth])
    radius = REACH * cells.spacing if cells.spacing else _scattered_radius(places)
    soundings = np.concatenate((places, depths[np.newaxis]))
    return Chart(path.name, soundings, radius, window.radius, scattered=not cells.spacing)


def _direction(cells: ChartCells, values: Floats, given: str) -> Positive:
    """The direction in which values increase: that of the option, or of the file, or as the values show.

    Negative values are elevations of water. Positive ones are depths in a text, whose third column is a depth; in a
    grid they may be land.
    """
    if given in ("up", "down"):
        return "up" if given == "up" else "down"
    if cells.positive:
        return cells.positive
    if (values <= 0.0).all():
        return "up"
    if (values >= 0.0).all() and not cells.spacing:
        return "down"
    raise BathymetryError(
        f"has values from {values.min():g} to {values.max():g} m and does not define which are below the water: set "
        "Chart Positive to up (elevations, as those of GEBCO and EMODnet) or down (depths)"
    )


def _raise_undeclared_fill(values: Floats) -> None:
    odd = values[(np.abs(values) > FARTHEST_VALUE) | np.isin(values, USUAL_FILL)]
    if odd.size:
        raise BathymetryError(
            f"has {odd.size} values such as {odd[0]:g} m, which are no depths: declare it as the file's value for no "
            "data, such as with gdal_edit -a_nodata"
        )


def _scattered_radius(places: Floats) -> float:
    """The radius of soundings that are as far apart on average as these (2, n) in their rectangle."""
    north, east = np.ptp(places, axis=1)
    density = places.shape[1] / max(1.0, float(north)) / max(1.0, float(east))
    return REACH / math.sqrt(density)
