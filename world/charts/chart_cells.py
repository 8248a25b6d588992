"""Places and values read from a chart, before it is known which way is up."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]
Positive = Literal["", "up", "down"]

DEGREE = 111_320.0  # m along a great circle


@dataclass(frozen=True)
class ChartCells:
    """Longitudes and latitudes (n,) in degrees, and values (n,) in m, NaN where the chart has none.

    `positive` is the direction in which the values increase, "" if the file does not give it. `spacing` is the distance
    (m) from a cell of a grid to the next one; None for scattered soundings.
    """

    longitude: Floats
    latitude: Floats
    values: Floats
    positive: Positive
    spacing: float | None


def join_blocks(blocks: Sequence[tuple[Floats, Floats, Floats]], positive: Positive) -> ChartCells:
    """The cells of blocks of a grid: longitude, latitude and values (rows, columns) of each."""
    longitude, latitude, values = (
        np.concatenate([part.ravel() for part in parts]) for parts in zip(*blocks, strict=True)
    )
    spacing = max((max(_steps(lon, lat)) for lon, lat, _ in blocks), default=0.0)
    return ChartCells(longitude, latitude, values, positive, spacing)


def _steps(longitude: Floats, latitude: Floats) -> tuple[float, float]:
    """The distances (m) from row to row and from column to column in the middle of a block; 0 of a single one."""
    rows, columns = longitude.shape
    row, column = max(0, rows // 2 - 1), max(0, columns // 2 - 1)

    def step(to_row: int, to_column: int) -> float:
        if to_row >= rows or to_column >= columns:
            return 0.0
        north = latitude[to_row, to_column] - latitude[row, column]
        east = math.remainder(longitude[to_row, to_column] - longitude[row, column], 360.0)
        return DEGREE * math.hypot(north, east * math.cos(math.radians(latitude[row, column])))

    return step(row + 1, column), step(row, column + 1)
