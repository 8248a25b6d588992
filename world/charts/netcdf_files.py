"""Reads charts in NetCDF, as GEBCO and EMODnet publish them, by netCDF4."""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from world.charts.chart_cells import ChartCells, Positive, join_blocks
from world.charts.chart_window import Box, ChartWindow
from world.charts.coordinates import Coordinates, parse_coordinates, require_library
from world.charts.raster_files import LARGEST_BLOCK, METERS
from world.sea import BathymetryError

Floats = NDArray[np.floating[Any]]

MOST_COLUMNS = 4_000_000  # of a row around the Earth, 10 m apart
EASTWARD = ("longitude", "projection_x_coordinate", "grid_longitude", "lon", "x", "easting")
NORTHWARD = ("latitude", "projection_y_coordinate", "grid_latitude", "lat", "y", "northing")
UP = ("elevation", "height", "altitude", "topo")  # the beginnings of names of what increases upward
DOWN = ("depth", "deptho", "sea_floor_depth", "bathymetry_depth")
KNOWN = ("elevation", "depth", "deptho", "depth_average", "bathymetry", "altitude", "height", "topo", "z", "band1")


def read_netcdf(path: Path, window: ChartWindow, given: Coordinates | None) -> ChartCells:
    """Read the part of a NetCDF file in a window. Raises BathymetryError."""
    library = require_library("netCDF4", "reading NetCDF")
    try:
        with library.Dataset(str(path)) as dataset:
            _raise_if_truncated(dataset, path)
            return _read_window(dataset, window, given)
    except BathymetryError:
        raise
    except (OSError, RuntimeError, ValueError, IndexError, TypeError, AttributeError, MemoryError) as error:
        reason = " ".join(str(error).replace(str(path), path.name).split())
        raise BathymetryError(f"cannot be read: {reason}") from None


def _read_window(dataset: Any, window: ChartWindow, given: Coordinates | None) -> ChartCells:
    variable, x, y = _find_grid(dataset)
    if (unit := _attribute(variable, "units").lower()) not in METERS:
        raise BathymetryError(f"has {variable.name} in {unit!r}; it must be in m")
    size = np.prod(variable.chunking() if isinstance(variable.chunking(), list) else [1], dtype=float)
    if size * variable.dtype.itemsize > LARGEST_BLOCK:
        raise BathymetryError(f"has {variable.name} in chunks of {variable.chunking()}, which are too large to read")
    coordinates = _coordinates(dataset, variable, x, y, given)
    columns_at, rows_at = _axis(x), _axis(y)
    regions = [
        (rows, columns)
        for box in window.boxes(coordinates)
        if (rows := _indices(rows_at, box.south, box.north)) and (columns := _indices(columns_at, box.west, box.east))
    ]
    window.raise_if_too_many(sum(len(rows) * len(columns) for rows, columns in regions))  # integers
    if not regions:
        extent = Box(*map(float, (columns_at.min(), rows_at.min(), columns_at.max(), rows_at.max())))
        window.raise_outside([extent], coordinates)
    blocks: list[tuple[Floats, Floats, Floats]] = []
    for rows, columns in regions:
        values = _values(variable, x, y, rows, columns)
        across, along = np.meshgrid(columns_at[columns.start : columns.stop], rows_at[rows.start : rows.stop])
        lon, lat = coordinates.to_degrees(across.ravel(), along.ravel())
        blocks.append((lon.reshape(values.shape), lat.reshape(values.shape), values))
    return join_blocks(blocks, _positive(variable))


def _raise_if_truncated(dataset: Any, path: Path) -> None:
    """Raise BathymetryError for a classic file that ends too early: the library would fill it up with zeros."""
    variables = dataset.variables.values() if dataset.data_model.startswith("NETCDF3") else ()
    needed = sum(variable.size * variable.dtype.itemsize for variable in variables)  # integers
    if (size := path.stat().st_size) < needed:
        raise BathymetryError(f"is truncated: it has {size} bytes of at least {needed}")


def _find_grid(dataset: Any) -> tuple[Any, Any, Any]:
    """The variable with the depths, and the coordinates of its columns and rows."""
    axes = {name: variable for name, variable in dataset.variables.items() if variable.dimensions == (name,)}
    found: list[tuple[Any, Any, Any]] = []
    for variable in dataset.variables.values():
        ends = [axes.get(name) for name in variable.dimensions]
        x = next((axis for axis in ends if axis is not None and _names(axis, EASTWARD)), None)
        y = next((axis for axis in ends if axis is not None and _names(axis, NORTHWARD)), None)
        others = [size for axis, size in zip(ends, variable.shape, strict=True) if axis not in (x, y)]
        if x is not None and y is not None and set(others) <= {1} and variable.dtype.kind in "iuf":
            found.append((variable, x, y))
    known = [grid for name in KNOWN for grid in found if _names(grid[0], (name,))]
    if not known and len(found) != 1:
        names = ", ".join(sorted(grid[0].name for grid in found) or sorted(dataset.variables)) or "none"
        reason = "has no grid of depths by latitude and longitude" if not found else "has several grids"
        raise BathymetryError(f"{reason}; one must be named elevation or depth (its variables: {names[:200]})")
    return (known or found)[0]


def _names(variable: Any, words: Iterable[str]) -> bool:
    """Whether the standard name or the name of a variable is one of some words."""
    return bool({_attribute(variable, "standard_name").lower(), str(variable.name).lower()} & set(words))


def _attribute(variable: Any, name: str) -> str:
    return str(getattr(variable, name, "") or "").strip()


def _coordinates(dataset: Any, variable: Any, x: Any, y: Any, given: Coordinates | None) -> Coordinates:
    """Coordinate system of the grid mapping (CF), or degrees, or that of the option."""
    mapping = dataset.variables.get(_attribute(variable, "grid_mapping"))
    text = next((found for name in ("crs_wkt", "spatial_ref", "epsg_code") if (found := _attribute(mapping, name))), "")
    if text:
        try:
            return parse_coordinates(f"EPSG:{text}" if re.fullmatch(r"\d+", text) else text)
        except BathymetryError as error:
            raise BathymetryError(f"has coordinates that cannot be used: {error}") from None
    degrees = _names(x, ("longitude", "lon")) or _attribute(x, "units").lower().startswith("degree")
    if given is None and not degrees:
        raise BathymetryError("does not name its coordinates: set Chart Coordinates, such as EPSG:32629")
    return given or Coordinates()


def _axis(variable: Any) -> Floats:
    """The coordinates of rows or columns, which must increase or decrease."""
    if variable.size > MOST_COLUMNS:
        raise BathymetryError(f"has {variable.size} coordinates {variable.name}, more than {MOST_COLUMNS}")
    found = np.ma.filled(np.ma.asarray(variable[:], dtype=np.float64), np.nan)
    steps = np.diff(found)
    if not (found.size and np.isfinite(found).all() and ((steps > 0.0).all() or (steps < 0.0).all())):
        raise BathymetryError(f"has coordinates {variable.name} that neither increase nor decrease")
    return found


def _indices(axis: Floats, least: float, most: float) -> range:
    """The cells between two coordinates, and one more on each side; none if the chart ends before."""
    step = abs(axis[-1] - axis[0]) / max(1, axis.size - 1)
    inside = np.flatnonzero((axis >= least - 0.5 * step) & (axis <= most + 0.5 * step))
    return range(max(0, int(inside[0]) - 1), min(axis.size, int(inside[-1]) + 2)) if inside.size else range(0)


def _values(variable: Any, x: Any, y: Any, rows: range, columns: range) -> Floats:
    """The values (rows, columns) in m, NaN where there are none; the library applies scale, offset and fill values."""
    places = {x.name: slice(columns.start, columns.stop), y.name: slice(rows.start, rows.stop)}
    found = variable[tuple(places.get(name, 0) for name in variable.dimensions)]
    values = np.ma.filled(np.ma.asarray(found, dtype=np.float64), np.nan)
    order = [name for name in variable.dimensions if name in places]
    return values if order == [y.name, x.name] else values.T


def _positive(variable: Any) -> Positive:
    direction = _attribute(variable, "positive").lower()
    if direction in ("up", "down"):
        return "up" if direction == "up" else "down"
    for name in (_attribute(variable, "standard_name").lower(), str(variable.name).lower()):
        if name.startswith(DOWN):
            return "down"
        if name.startswith(UP) or name.endswith(("_altitude", "_height_above_geoid", "_elevation")):
            return "up"
    return ""
