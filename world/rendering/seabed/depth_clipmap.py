"""Grids of the depths of the sea, finer the nearer they are, and curves between their nodes that follow the bottom."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from support.rotations import Vector
from world.sea import Bathymetry

Floats = NDArray[np.floating[Any]]
Places = NDArray[np.intp]

FINEST = 0.25  # m, between the depths of the first grid; each next one is COARSER times as coarse and as wide
COARSER = 4
REACH = 16.0  # m around the camera in which the first grid counts
LEVELS = 4
CURVED = 3  # of these, whose curves are compared with the bottom: coarser ones seldom follow it
TILE = 32  # cells: grids consist of tiles at fixed places, so that a depth does not depend on where the camera was
MARGIN = 4.0  # cells around what is looked up: curves and their errors are those of several nodes
SAFE = 2.0  # times as much as curves were found to err, they may err in between
WHOLE = np.zeros(TILE), np.zeros(TILE)  # where in cells depths are taken: north, east
# At quarters of a cell, and not in its middle, errors of the third order are the largest. North and east they may
# cancel in one cell, but not in the next one as well, which is probed at three quarters.
ASIDE = np.full(TILE, 0.25), np.where(np.arange(TILE) % 2, 0.75, 0.25)

Number = tuple[int, int, int]
"""The level of a tile, and its place in its grid."""


class DepthGrid(NamedTuple):
    """Depths (m) at nodes `step` m apart, from `north`, `east`; row by row of `columns`.

    In the cell of a node, x and y (0 to 1) north and east of it, the depth is `coefficients` (4, nodes) times 1, x, y
    and xy. It is nowhere steeper than `steepest`, m per m, and nowhere out of `shallowest` and `deepest`.
    `shallowest_nearby` are the least depths in a cell, by its corner, and in the eight around it.
    """

    north: float
    east: float
    step: float
    coefficients: Floats
    columns: int
    steepest: float
    shallowest: float
    deepest: float
    shallowest_nearby: Floats

    @property
    def node_depths(self) -> Floats:
        """Depths (rows, columns)."""
        found: Floats = self.coefficients[0].reshape(-1, self.columns)
        return found

    def depths(self, north: Floats, east: Floats) -> Floats:
        """Bilinear."""
        corner, x, y = self.cells_at(north, east)
        found, along, across, twist = self.coefficients.take(corner, axis=1, mode="clip")
        twist *= y
        along += twist
        along *= x
        across *= y
        found += along
        found += across
        return found

    def cells_at(self, north: Floats, east: Floats) -> tuple[Places, Floats, Floats]:
        """The corners of the cells that hold places, and where in these they are, 0 to 1 north and east."""
        x, y, scale = north - self.north, east - self.east, 1.0 / self.step  # a power of two
        x *= scale
        y *= scale
        i, j = np.floor(x), np.floor(y)
        x -= i
        y -= j
        i *= self.columns
        i += j
        return i.astype(np.intp), x, y


class CurvedDepthGrid(NamedTuple):
    """The same, bent in each cell as its neighbors give it: `coefficients` (6, nodes) times 1, x, y, xy, x² and y².

    `errors` (nodes) is how far (m) that may be from the bottom in a cell, as found where smooth ones err most.
    """

    grid: DepthGrid
    coefficients: Floats
    errors: Floats

    @classmethod
    def from_grid(cls, grid: DepthGrid) -> "CurvedDepthGrid":
        """A grid with errors that are not known yet."""
        bends = _bend(grid.node_depths).ravel(), _bend(grid.node_depths.T).T.ravel()
        parts = np.concatenate((grid.coefficients, bends))
        parts[1] -= bends[0]
        parts[2] -= bends[1]
        return cls(grid, parts, np.empty(0))

    def depths(self, north: Floats, east: Floats) -> Floats:
        corner, x, y = self.grid.cells_at(north, east)
        found, along, across, twist, bend, lean = self.coefficients.take(corner, axis=1, mode="clip")
        twist *= y
        bend *= x
        along += twist
        along += bend
        along *= x
        lean *= y
        across += lean
        across *= y
        found += along
        found += across
        return found

    def errors_at(self, north: Floats, east: Floats) -> Floats:
        return self.errors.take(self.grid.cells_at(north, east)[0], mode="clip")


class DepthClipmap:
    """The grids of a bottom around cameras. What is kept for the next picture does not depend on the last one."""

    def __init__(self, sea: Bathymetry):
        self.sea = sea
        self._tiles: dict[Number, Floats] = {}
        self._probes: dict[Number, Floats] = {}
        self._grids: dict[int, tuple[tuple[int, int, int, int], DepthGrid]] = {}
        self._curved: dict[int, CurvedDepthGrid] = {}

    def grid_around(self, level: int, place: Vector) -> DepthGrid:
        """The grid of a level around a place."""
        step = FINEST * COARSER**level
        side, reach = step * TILE, REACH * COARSER**level + MARGIN * step
        first = [math.floor((middle - reach) / side) for middle in place[:2]]
        last = [math.floor((middle + reach) / side) + 1 for middle in place[:2]]
        wanted = first[0], first[1], last[0], last[1]
        kept = self._grids.get(level)
        if kept is not None and kept[0] == wanted:
            return kept[1]
        nodes = self._laid(self._tiles, level, wanted, WHOLE)
        slopes = math.hypot(*(float(np.abs(np.diff(nodes, axis=axis)).max()) / step for axis in (0, 1)))
        ends = float(nodes.min()), float(nodes.max())
        corner = first[0] * side, first[1] * side
        grid = DepthGrid(*corner, step, _parts(nodes), nodes.shape[1], slopes, *ends, _least(nodes).ravel())
        self._grids[level] = wanted, grid
        self._curved.pop(level, None)
        return grid

    def curved_grid_around(self, level: int, place: Vector) -> CurvedDepthGrid:
        """The curves of the grid of a level, below CURVED, around a place."""
        grid, kept = self.grid_around(level, place), self._curved.get(level)
        if kept is not None:
            return kept
        probes = self._laid(self._probes, level, self._grids[level][0], ASIDE)
        found = CurvedDepthGrid.from_grid(grid)
        rows, columns = np.arange(len(probes)), np.arange(grid.columns)
        north = grid.north + grid.step * (rows + ASIDE[0][rows % TILE])
        east = grid.east + grid.step * (columns + ASIDE[1][columns % TILE])
        between = found.depths(*(each.ravel() for each in np.meshgrid(north, east, indexing="ij")))
        errors = SAFE * _around(np.abs(between.reshape(probes.shape) - probes))
        self._curved[level] = found = found._replace(errors=errors.ravel())
        return found

    def _laid(
        self, kept: dict[Number, Floats], level: int, ends: tuple[int, int, int, int], aside: tuple[Floats, Floats]
    ) -> Floats:
        """The depths of the tiles from the first to before the last ones, at places in cells; `kept` keeps them."""
        top, left, bottom, right = ends
        found, tiles = np.empty((TILE * (bottom - top), TILE * (right - left))), dict[Number, Floats]()
        step = FINEST * COARSER**level
        for i in range(top, bottom):
            for j in range(left, right):
                key = level, i, j
                tile = kept.get(key)
                if tile is None:
                    north, east = (
                        (TILE * n + np.arange(TILE) + own) * step for n, own in zip((i, j), aside, strict=True)
                    )
                    tile = self._depths(north, east)
                tiles[key] = tile
                row, column = TILE * (i - top), TILE * (j - left)
                found[row : row + TILE, column : column + TILE] = tile
        for key in [key for key in kept if key[0] == level]:
            del kept[key]
        kept.update(tiles)
        return found

    def _depths(self, north: Floats, east: Floats) -> Floats:
        places = (each.ravel() for each in np.meshgrid(north, east, indexing="ij"))
        return self.sea.depths(*places).reshape(len(north), len(east))


def _parts(nodes: Floats) -> Floats:
    """(4, nodes) the depths at nodes, their rise to the next one north and east, and the twist; 0 at the border."""
    found = np.zeros((4, *nodes.shape))
    found[0] = nodes
    found[1, :-1] = nodes[1:] - nodes[:-1]
    found[2, :, :-1] = nodes[:, 1:] - nodes[:, :-1]
    found[3, :-1] = found[2, 1:] - found[2, :-1]
    return found.reshape(4, -1)


def _bend(nodes: Floats) -> Floats:
    """Half the second differences down the columns, in the middle of cells, by their corners; 0 at the border."""
    found = np.zeros(nodes.shape)
    steps = np.diff(nodes, axis=0)
    own = 0.25 * (steps[2:] - steps[:-2])
    found[1:-2, :-1] = 0.5 * (own[:, 1:] + own[:, :-1])
    return found


def _least(nodes: Floats) -> Floats:
    """The least at the corners of each cell and its eight neighbors, by its corner; infinite at the border."""
    found = np.full(nodes.shape, np.inf)
    rows, columns = nodes.shape
    across = np.minimum.reduce([nodes[:, n : columns - 3 + n] for n in range(4)])
    found[1:-2, 1:-2] = np.minimum.reduce([across[n : rows - 3 + n] for n in range(4)])
    return found


def _around(values: Floats) -> Floats:
    """The largest among each one and its eight neighbors."""
    for axis in (0, 1):
        padded = np.pad(values, [(1, 1) if axis == n else (0, 0) for n in (0, 1)], mode="edge")
        values = np.maximum(
            np.maximum(padded.take(range(2, padded.shape[axis]), axis), values),
            padded.take(range(padded.shape[axis] - 2), axis),
        )
    return values
