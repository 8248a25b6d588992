"""Exact distances from a camera to the relief of the seabed, for all pixels of its picture."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from support.rotations import Vector
from world.optics import CameraModel, Floats
from world.rendering.cube_faces import face_rotations
from world.rendering.pixel_rays import PixelRays
from world.rendering.remap_table import RemapTable, finest_face_width
from world.rendering.seabed.ray_interpolation import (
    PITCH,
    TINY,
    FacePatch,
    RayGrid,
    reduce_corners,
    rotate,
    second_differences,
)
from world.rendering.seabed.seabed_intersection import SeabedIntersector

Places = NDArray[np.intp]

FACES = 6
ERROR = 2e-4  # share of a distance that may be wrong where it is interpolated between rays
NEARLY = 0.1  # share of a distance by which it may be wrong to be settled from there
BLOCK = 1 << 14  # pixels per step: their arrays fit into the L2 cache


class InterpolationCells(NamedTuple):
    """Interpolation of nearness in cells (n,): `parts` (6, n) times the shares of a pixel; `errors` (n,) of that.

    Those cells are `crooked` (n,) in which it may err by more than ERROR.
    """

    parts: NDArray[np.float32]
    errors: Floats
    crooked: NDArray[np.bool_]


class DepthImage:
    """Distances to a relief: by a lattice of rays, finer where the ground bends, and by pixels where it is rough."""

    def __init__(self, optics: CameraModel, rays: PixelRays, relief: SeabedIntersector):
        self.relief: SeabedIntersector = relief
        self._rays = rays
        self._width, self._turns = finest_face_width(optics), face_rotations(FACES)
        lookup = RemapTable(optics, self._width, FACES)
        self._lattice = lattice = RayGrid(self._width, self._turns, list(zip(lookup.rows, lookup.columns, strict=True)))
        covered = rays.covered
        face = np.where(covered, lookup.face.ravel(), -1)
        u, v = (np.where(covered, place.ravel(), 0.0) / PITCH for place in (lookup.u, lookup.v))
        cell, self._along = np.full(face.size, -1), np.full(face.size, np.nan)
        count = 0
        for number, (patch, turn) in enumerate(zip(lattice.patches, self._turns, strict=True)):
            own = np.flatnonzero(face == number)
            rows, columns = patch.shape
            if own.size:
                i = np.clip(np.floor(u[own]).astype(np.intp) - patch.column, 0, columns - 2)
                j = np.clip(np.floor(v[own]).astype(np.intp) - patch.row, 0, rows - 2)
                u[own] -= i + patch.column
                v[own] -= j + patch.row
                cell[own] = count + j * (columns - 1) + i
                self._along[own] = rotate(turn.T, rays.directions[:, own])[2]
                count += (rows - 1) * (columns - 1)
        self._cell, self._shares = np.maximum(cell, 0), _shares(u, v, self._along)
        self._pixels = np.argsort(cell, kind="stable")[np.count_nonzero(cell < 0) :]  # cell by cell
        self._first = np.searchsorted(cell[self._pixels], np.arange(count + 1))

    def inverse_distances(self, place: Vector, turn: Floats) -> NDArray[np.float64]:
        """1 over the distance (m) of each pixel, 0 or less where there is no ground, NaN where the lens sees nothing.

        The camera is at a place (m; north, east, down); `turn` (3, 3) rotates its frame to NED.
        """
        lattice = self._lattice
        near, rough = self.relief.intersect(place, rotate(turn, lattice.rays), exact=True, cell=lattice.cell)
        cells, found = self._looked_over(near, rough), np.empty(self._along.size)
        for start in range(0, found.size, BLOCK):
            part = slice(start, start + BLOCK)
            shown = cells.parts.take(self._cell[part], axis=1, mode="clip")
            found[part] = np.einsum("ij,ij->j", shown, self._shares[:, part])
        own, cell = self._within(np.flatnonzero(cells.crooked))
        errs, guess = cells.errors[cell] * self._along[own], np.maximum(found[own], 0.0)
        cast = np.flatnonzero(errs > ERROR * guess)
        own, about = own[cast], (errs < NEARLY * guess)[cast]
        rays = rotate(turn, self._rays.directions.take(own, axis=1))
        if place[2] <= self.relief.sea.shallowest:  # all ground is below
            down = rays[2] > 0.0
            found[own[~down]] = 0.0
            own, about, rays = own[down], about[down], rays.compress(down, axis=1)
        if about.any():
            closer, good = self.relief.refine(place, rays.compress(about, axis=1), found[own[about]])
            found[own[about]] = closer
            about[about] = good
        if not about.all():
            found[own[~about]], _ = self.relief.intersect(place, rays.compress(~about, axis=1), exact=True)
        return found

    def _looked_over(self, near: Floats, rough: NDArray[np.bool_]) -> InterpolationCells:
        found = [_cells(patch, near, rough) for patch in self._lattice.patches if min(patch.shape) > 1]
        return InterpolationCells(*(np.concatenate(each, axis=-1) for each in zip(*found, strict=True)))

    def _within(self, cells: Places) -> tuple[Places, Places]:
        """The pixels in cells, and the cell of each."""
        first, count = self._first[cells], self._first[cells + 1] - self._first[cells]
        start = np.cumsum(count) - count
        return self._pixels[np.arange(count.sum()) + np.repeat(first - start, count)], np.repeat(cells, count)


def _cells(patch: FacePatch, near: Floats, rough: NDArray[np.bool_]) -> InterpolationCells:
    """Interpolation of nearness in the cells of a patch, by that of all rays."""
    w = patch.select_face_values(near)
    across, down = w[:, 1:] - w[:, :-1], w[1:] - w[:-1]
    straight, errors = np.zeros(w.shape), np.zeros(tuple(n - 1 for n in w.shape))
    parts = np.empty((6, *errors.shape), dtype=np.float32)
    parts[:4] = w[:-1, :-1], across[:-1], down[:, :-1], across[1:] - across[:-1]
    for axis, part in ((1, parts[4]), (0, parts[5])):
        bend = second_differences(w, axis)
        straight += np.abs(bend) / 8.0
        middle = reduce_corners(bend, np.add) / 4.0
        np.divide(middle, 2.0, out=part, casting="same_kind")
        errors += np.maximum(reduce_corners(bend, np.maximum) - middle, middle - reduce_corners(bend, np.minimum)) / 8.0
    border = np.ones(errors.shape, dtype=np.bool_)
    border[1:-1, 1:-1] = False  # beyond it, it is not known how edges are bent
    errors[border] = reduce_corners(straight, np.maximum)[border]
    errors[reduce_corners(patch.select_face_values(rough), np.logical_or)] = np.inf
    return InterpolationCells(
        parts.reshape(6, -1), errors.ravel(), (errors > reduce_corners(ERROR * np.abs(w) + TINY, np.minimum)).ravel()
    )


def _shares(right: Floats, down: Floats, along: Floats) -> NDArray[np.float32]:
    """(6, n) of the parts of a cell in what is seen in it: bilinear, and as it is bent across and down."""
    bent = right * (right - 1.0), down * (down - 1.0)
    return np.stack([along, *(along * share for share in (right, down, right * down, *bent))]).astype(np.float32)
