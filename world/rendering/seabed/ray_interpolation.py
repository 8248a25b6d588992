"""A lattice of rays over the faces of a camera, between which what it sees of the ground is interpolated."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from world.rendering.cube_faces import Window

Floats = NDArray[np.floating[Any]]
Bools = NDArray[np.bool_]
Places = NDArray[np.intp]

PITCH = 8  # pixels of a face between two rays
TINY = 1e-12


class FacePatch(NamedTuple):
    """The part of a lattice on one face: `nodes` of all rays, in rows and columns of a `shape`.

    The first ones go through the pixel in PITCH times `row` and `column`.
    """

    nodes: slice
    shape: tuple[int, int]
    row: int
    column: int

    def select_face_values(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values (..., rays) of this face (..., rows, columns)."""
        return values[..., self.nodes].reshape(*values.shape[:-1], *self.shape)


class RayGrid:
    """Rays through every PITCH-th pixel of `windows` of faces of `width` px, whose frames `turns` (f, 3, 3) rotate.

    A nearness, 1 over the distance along the axis of a face, is linear across it for all planes, so that planes are
    exact between the rays.
    """

    def __init__(self, width: int, turns: NDArray[np.float64], windows: Sequence[Window]):
        self.width = width
        self.cell: float = 2.0 * PITCH / width
        self.patches: list[FacePatch] = []
        rays: list[Floats] = [np.empty((3, 0))]
        count = 0
        for turn, ((top, bottom), (left, right)) in zip(turns, windows, strict=True):
            rows, columns = (
                np.arange(first // PITCH, (last - 1) // PITCH + 2) if last > first else np.arange(0)
                for first, last in ((top, bottom), (left, right))
            )
            y, x = ((2.0 * PITCH * places + 1.0) / width - 1.0 for places in (rows, columns))
            grid = np.stack((*np.meshgrid(x, y), np.ones((len(y), len(x))))).reshape(3, -1)
            rays.append(rotate(turn, grid))
            nodes = slice(count, count + grid.shape[1])
            self.patches.append(FacePatch(nodes, (len(y), len(x)), top // PITCH, left // PITCH))
            count += grid.shape[1]
        self.rays: Floats = np.concatenate(rays, axis=1)

    def interpolation_errors(self, nearness: Floats, rough: Bools, error: Floats, nearest: float) -> list[Floats]:
        """Errors of interpolation in the cells (rows - 1, columns - 1) of each face, as share of `error` (rays).

        That is infinite at rays in the rough. Cells in which all is farther than a nearness of `nearest` do not count.
        """
        found: list[Floats] = []
        for patch in self.patches:
            w, given, most = (
                patch.select_face_values(nearness),
                patch.select_face_values(rough),
                patch.select_face_values(error),
            )
            if not w.size:
                found.append(np.zeros((0, 0)))
                continue
            errors = np.zeros(w.shape)
            for axis in (0, 1):
                errors += np.abs(second_differences(w, axis)) / 8.0
            worst = reduce_corners(np.where(given, np.inf, errors / most), np.maximum)
            worst[reduce_corners(w, np.maximum) <= nearest] = 0.0
            found.append(worst)
        return found


def rotate(turn: Floats, vectors: Floats) -> Floats:
    """Rotation without a library, whose sums may depend on the number of its threads."""
    x, y, z = vectors
    return np.stack([a * x + b * y + c * z for a, b, c in turn.tolist()])


def interpolate_nodes(values: Floats, rows: slice) -> Floats:
    """Values at the nodes (k, n, m) of some rows of cells, at their pixels (k, PITCH * rows, PITCH * (m - 1))."""
    share = (np.arange(PITCH) / PITCH).astype(values.dtype)
    own = values[:, rows.start : rows.stop + 1]
    step = own[..., 1:] - own[..., :-1]
    wide = step[..., np.newaxis] * share
    wide += own[..., :-1, np.newaxis]
    wide = wide.reshape(*own.shape[:2], -1)
    step = wide[:, 1:] - wide[:, :-1]
    tall = step[:, :, np.newaxis] * share[:, np.newaxis]
    tall += wide[:, :-1, np.newaxis]
    return tall.reshape(len(values), -1, wide.shape[2])


def second_differences(values: Floats, axis: int) -> Floats:
    """Second differences (n, m) along an axis; at the border those next to it, 0 where there are too few values."""
    found = np.zeros(values.shape)
    if values.shape[axis] > 2:
        along, given = (each.T if axis else each for each in (found, values))
        along[1:-1] = given[2:] - 2.0 * given[1:-1] + given[:-2]
        along[0], along[-1] = along[1], along[-2]
    return found


def reduce_corners(values: Any, fold: Any) -> Any:
    """Reduce the four corners of each cell by `fold`."""
    rows = fold(values[1:], values[:-1])
    return fold(rows[:, 1:], rows[:, :-1])
