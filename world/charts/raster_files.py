"""Reads charts that are rasters: GeoTIFF and ESRI's ASCII grid, by rasterio."""

import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from world.charts.chart_cells import ChartCells, Positive, join_blocks
from world.charts.chart_window import Box, ChartWindow
from world.charts.coordinates import Coordinates, require_library
from world.sea import BathymetryError

Floats = NDArray[np.floating[Any]]

LARGEST_BLOCK = 256 << 20  # bytes; a block of a file is read as a whole
METERS = ("", "m", "metre", "meter", "metres", "meters")


def read_geotiff(path: Path, window: ChartWindow, given: Coordinates | None) -> ChartCells:
    """Read the part of a GeoTIFF in a window. Raises BathymetryError."""
    return _read_raster(path, "GTiff", window, given)


def read_esri_grid(path: Path, window: ChartWindow, given: Coordinates | None) -> ChartCells:
    """Read the part of an ESRI ASCII grid in a window. Raises BathymetryError."""
    return _read_raster(path, "AAIGrid", window, given)


def _read_raster(path: Path, driver: str, window: ChartWindow, given: Coordinates | None) -> ChartCells:
    rasterio = require_library("rasterio", "reading GeoTIFF" if driver == "GTiff" else "reading an ESRI grid")
    try:
        with rasterio.Env(), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of a file without georeference, which is an error here
            with rasterio.open(path, driver=driver) as dataset:
                return _read_window(rasterio, dataset, window, given)
    except rasterio.errors.RasterioError as error:
        raise BathymetryError(f"cannot be read: {_innermost(error, path)}") from None


def _read_window(rasterio: Any, dataset: Any, window: ChartWindow, given: Coordinates | None) -> ChartCells:
    coordinates = _coordinates(dataset, given)
    if dataset.count != 1:
        raise BathymetryError(f"has {dataset.count} bands; a chart has one")
    if np.dtype(dataset.dtypes[0]).kind not in "iuf":
        raise BathymetryError(f"has values of the type {dataset.dtypes[0]}, which are no depths")
    if (unit := (dataset.units[0] or "").lower()) not in METERS:
        raise BathymetryError(f"has values in {unit!r}; they must be in m")
    rows, columns = dataset.block_shapes[0]
    if (size := rows * columns * np.dtype(dataset.dtypes[0]).itemsize) > LARGEST_BLOCK:
        raise BathymetryError(
            f"is stored in blocks of {rows} x {columns} cells ({size >> 20} MB): write it in tiles, such as with "
            "gdal_translate -co TILED=YES"
        )
    regions = [_region(dataset, box) for box in window.boxes(coordinates)]
    regions = [region for region in regions if region is not None]
    cells = sum((bottom - top) * (right - left) for top, bottom, left, right in regions)  # integers
    window.raise_if_too_many(cells)
    if not regions:
        window.raise_outside([Box(*_corners(dataset))], coordinates)
    return join_blocks([_block(rasterio, dataset, coordinates, *region) for region in regions], _positive(dataset))


def _coordinates(dataset: Any, given: Coordinates | None) -> Coordinates:
    if dataset.transform.is_identity or dataset.transform.is_degenerate:
        raise BathymetryError("has no georeference: the place of its cells is unknown")
    if dataset.crs is None:
        west, south, east, north = _corners(dataset)
        if given is None and not (west >= -360.0 and east <= 360.0 and south >= -90.1 and north <= 90.1):
            raise BathymetryError("does not name its coordinates: set Chart Coordinates, such as EPSG:32629")
        return given or Coordinates()
    own = Coordinates(dataset.crs)
    if given is not None and str(given) != str(own):
        raise BathymetryError(f"has coordinates in {own}, not in the Chart Coordinates {given}: remove this option")
    if not own.in_degrees and not (dataset.crs.is_projected or dataset.crs.is_geographic):
        raise BathymetryError(f"has coordinates in {own}, which are no place on Earth")
    return own


def _apply(transform: Any, column: Any, row: Any) -> tuple[Any, Any]:
    return (
        transform.a * column + transform.b * row + transform.c,
        transform.d * column + transform.e * row + transform.f,
    )


def _corners(dataset: Any) -> tuple[float, float, float, float]:
    corners = [_apply(dataset.transform, x, y) for x in (0, dataset.width) for y in (0, dataset.height)]
    east, north = zip(*corners, strict=True)
    return min(east), min(north), max(east), max(north)


def _region(dataset: Any, box: Box) -> tuple[int, int, int, int] | None:
    """First and last row and column of the cells in a box and around it; None without any."""
    inverse = ~dataset.transform
    corners = [_apply(inverse, x, y) for x in (box.west, box.east) for y in (box.south, box.north)]
    columns, rows = zip(*corners, strict=True)
    left, right = max(0, math.floor(min(columns)) - 1), min(dataset.width, math.ceil(max(columns)) + 1)
    top, bottom = max(0, math.floor(min(rows)) - 1), min(dataset.height, math.ceil(max(rows)) + 1)
    if max(columns) < 0.0 or min(columns) > dataset.width or max(rows) < 0.0 or min(rows) > dataset.height:
        return None
    return (top, bottom, left, right) if left < right and top < bottom else None


def _block(
    rasterio: Any, dataset: Any, coordinates: Coordinates, top: int, bottom: int, left: int, right: int
) -> tuple[Floats, Floats, Floats]:
    part = rasterio.windows.Window(left, top, right - left, bottom - top)
    found = dataset.read(1, window=part, masked=True)
    values = np.ma.filled(found.astype(np.float64), np.nan) * dataset.scales[0] + dataset.offsets[0]
    columns, rows = np.meshgrid(np.arange(left, right) + 0.5, np.arange(top, bottom) + 0.5)
    x, y = _apply(dataset.transform, columns.ravel(), rows.ravel())
    lon, lat = coordinates.to_degrees(x, y)
    return lon.reshape(values.shape), lat.reshape(values.shape), values


def _positive(dataset: Any) -> Positive:
    """The direction in the band's name, or that of the NetCDF variable from which GDAL or EMODnet made it."""
    band, variables = dataset.tags(1), {key.partition("#")[0] for key in dataset.tags() if "#" in key}
    names = " ".join([dataset.descriptions[0] or "", band.get("NETCDF_VARNAME", ""), *sorted(variables)]).lower()
    down, up = "depth" in names, "elevation" in names or "height" in names
    return "" if down == up else "down" if down else "up"


def _innermost(error: BaseException, path: Path) -> str:
    """The message of GDAL, in one line without the folder of the file."""
    while (cause := error.__cause__ or error.__context__) is not None:
        error = cause
    return " ".join(str(error).replace(str(path), path.name).split())
