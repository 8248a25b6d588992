"""Reads charts that are text: a sounding in each line, two coordinates and a depth."""

import math
import re
from collections.abc import Iterator, Sequence
from itertools import chain, islice
from pathlib import Path
from typing import Any, NamedTuple, NoReturn, TextIO

import numpy as np
from numpy.typing import NDArray

from support.number_parsing import is_number
from world.charts.chart_cells import ChartCells, Positive
from world.charts.chart_window import Box, ChartWindow
from world.charts.coordinates import Coordinates
from world.charts.raster_files import read_esri_grid
from world.sea import BathymetryError

Floats = NDArray[np.floating[Any]]

X = ("x", "lon", "long", "longitude", "easting", "east", "e")
Y = ("y", "lat", "latitude", "northing", "north", "n")
DOWN, UP, EITHER = ("depth",), ("elevation", "height", "altitude"), ("z", "value")
IN_DEGREES = ("lon", "long", "longitude", "lat", "latitude")
SEPARATORS = ";\t,"  # else blanks
LONGEST_LINE = 1000  # characters
LINES_AT_ONCE = 1 << 16


class _Columns(NamedTuple):
    """The columns of longitude or easting, latitude or northing, and depth; `degrees` is None if unknown."""

    x: int = 0
    y: int = 1
    depth: int = 2
    total: int = 3
    positive: Positive = ""
    degrees: bool | None = None


def read_text(path: Path, window: ChartWindow, given: Coordinates | None) -> ChartCells:
    """Read the soundings of a text file in a window. Raises BathymetryError, which names the line.

    A line has a longitude and a latitude in degrees, or an easting and a northing, and a depth, separated by blanks,
    commas or semicolons. A first line with the names of the columns may order them differently, and add others.
    """
    try:
        with path.open(encoding="utf-8-sig", errors="replace") as lines:
            if lines.readline(LONGEST_LINE).lower().startswith("ncols"):
                return read_esri_grid(path, window, given)
            lines.seek(0)
            return _read_lines(path.name, lines, window, given)
    except OSError as error:
        raise BathymetryError(f"cannot be read: {error.strerror}") from None


def _read_lines(name: str, lines: TextIO, window: ChartWindow, given: Coordinates | None) -> ChartCells:
    rows = _rows(lines)
    number, first = next(rows, (0, ""))
    if not first:
        raise BathymetryError("has no sounding")
    separator = next((mark for mark in SEPARATORS if mark in first), None)
    columns = _header(name, number, _words(first, separator))
    if columns is None:
        columns, rows = _Columns(), chain([(number, first)], rows)
    coordinates = _coordinates(columns, given)
    boxes, found = window.boxes(coordinates), list[Floats]()
    extent, swapped = Box(math.inf, math.inf, -math.inf, -math.inf), 0
    while part := list(islice(rows, LINES_AT_ONCE)):
        x, y, depth = table = _table(name, part, columns, separator)
        off = (np.abs(x) > 360.0) | (np.abs(y) > 90.0) if coordinates.in_degrees else np.zeros(x.shape, bool)
        if off.any():
            hint = "" if columns.degrees or given else "; set Chart Coordinates for others, such as EPSG:32629"
            at = int(off.argmax())
            _fail(name, part[at][0], f"{x[at]:.10g}, {y[at]:.10g} is not a longitude and a latitude in degrees{hint}")
        extent = Box(
            min(extent.west, x.min()), min(extent.south, y.min()), max(extent.east, x.max()), max(extent.north, y.max())
        )
        inside = _are_in(boxes, x, y)
        swapped += int(_are_in(boxes, y, x).sum())
        found.append(table[:, inside])
        window.raise_if_too_many(sum(piece.shape[1] for piece in found))  # integers
    if not found:
        raise BathymetryError("has no sounding after the names of its columns")
    x, y, depth = np.concatenate(found, axis=1)
    if not x.size and swapped:
        order = "latitude before longitude" if coordinates.in_degrees else "northing before easting"
        raise BathymetryError(f"has {order}: name its columns in a first line, such as {'lat lon depth'!r}")
    if not x.size:
        window.raise_outside([extent], coordinates)
    return ChartCells(*coordinates.to_degrees(x, y), depth, columns.positive, None)


def _coordinates(columns: _Columns, given: Coordinates | None) -> Coordinates:
    if given is None and columns.degrees is False:
        raise BathymetryError("does not name its coordinates: set Chart Coordinates, such as EPSG:32629")
    if given is not None and columns.degrees and not given.in_degrees:
        raise BathymetryError(f"has longitude and latitude, not the Chart Coordinates {given}: remove this option")
    return given or Coordinates()


def _rows(lines: TextIO) -> Iterator[tuple[int, str]]:
    """The number of each line with words, and its text."""
    number = 0
    while line := lines.readline(LONGEST_LINE):
        number += 1
        if (text := line.strip()) and not text.startswith(("#", "%", "//")):
            yield number, text


def _words(text: str, separator: str | None) -> list[str]:
    return [word.strip() for word in text.split(separator)]


def _table(name: str, rows: Sequence[tuple[int, str]], columns: _Columns, separator: str | None) -> Floats:
    """Two coordinates and the depth (3, n) of each row."""
    texts = [text for _, text in rows]
    places = columns.x, columns.y, columns.depth
    try:
        if all(len(text.split(separator)) == columns.total for text in texts):
            found = np.loadtxt(texts, delimiter=separator, comments=None, ndmin=2, usecols=places).T
            if np.isfinite(found[:2]).all():
                return found
    except ValueError:
        pass
    for number, text in rows:
        _raise_if_no_sounding(name, number, _words(text, separator), columns)
    _fail(name, rows[0][0], "from this line on, something is not a sounding")


def _raise_if_no_sounding(name: str, number: int, words: list[str], columns: _Columns) -> None:
    if len(words) != columns.total:
        hint = " (a first line may name the columns)" if columns == _Columns() else ""
        _fail(name, number, f"has {len(words)} columns instead of {columns.total}{hint}")
    try:
        x, y, _ = (float(words[index]) for index in (columns.x, columns.y, columns.depth))
    except ValueError:
        x = y = math.nan
    if not math.isfinite(x + y):
        hint = " (decimals need a point)" if any("," in word for word in words) else ""
        _fail(name, number, f"{' '.join(words)[:80]!r} is not two coordinates and a depth{hint}")


def _header(name: str, number: int, words: list[str]) -> _Columns | None:
    """The columns by their names in the first line; None if it has numbers."""
    if not words or any(map(is_number, words)):
        return None
    names = [re.sub(r"[\s_]*[\[(].*", "", word.strip("\"'")).lower() for word in words]

    def column(*known: str) -> int:
        places = [index for index, word in enumerate(names) if word in known]
        if len(places) != 1:
            wanted = "lon, lat and depth, or easting, northing and depth"
            _fail(name, number, f"the names of the columns are {', '.join(words)!r}; {wanted} are needed")
        return places[0]

    x, y, depth = column(*X), column(*Y), column(*DOWN, *UP, *EITHER)
    positive: Positive = "down" if names[depth] in DOWN else "up" if names[depth] in UP else ""
    degrees = names[x] in IN_DEGREES and names[y] in IN_DEGREES
    either = names[x] == "x" and names[y] == "y"
    return _Columns(x, y, depth, len(words), positive, None if either else degrees)


def _are_in(boxes: Sequence[Box], x: Floats, y: Floats) -> NDArray[np.bool_]:
    inside = [(box.west <= x) & (x <= box.east) & (box.south <= y) & (y <= box.north) for box in boxes]
    return np.any(inside, axis=0)


def _fail(name: str, number: int, reason: str) -> NoReturn:
    raise BathymetryError(f"{name}:{number}: {reason}")
