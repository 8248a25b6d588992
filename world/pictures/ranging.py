"""Exact distances from a camera to the relief of the seabed, for all pixels of its picture."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from world.attitude import Vector
from world.optics import CameraModel, Floats
from world.pictures.faces import rotations
from world.pictures.lattice import PITCH, TINY, Lattice, Patch, corners, second, turned
from world.pictures.lookup import Lookup, finest_face
from world.pictures.rays import Rays
from world.pictures.relief import Relief

Places = NDArray[np.intp]

FACES = 6
ERROR = 2e-4  # share of a distance that may be wrong where it is interpolated between rays
NEARLY = 0.1  # share of a distance by which it may be wrong to be settled from there
BLOCK = 1 << 14  # pixels per step: their arrays fit into the L2 cache


class Cells(NamedTuple):
    """What interpolation does in cells (n,): where it errs by more than ERROR, and by how much if edges are bent.

    `bends` (2, n) are half the second differences across and down.
    """

    crooked: NDArray[np.bool_]
    bent: Floats
    bends: Floats


class Ranging:
    """Distances to a relief: by a lattice of rays, finer where the ground bends, and by pixels where it is rough."""

    def __init__(self, optics: CameraModel, rays: Rays, relief: Relief):
        self.relief, self._rays = relief, rays
        self._width, self._turns = finest_face(optics), rotations(FACES)
        lookup = Lookup(optics, self._width, FACES)
        self._lattice = lattice = Lattice(self._width, self._turns, list(zip(lookup.rows, lookup.columns, strict=True)))
        covered = rays.covered
        face = np.where(covered, lookup.face.ravel(), -1)
        u, v = (np.where(covered, place.ravel(), 0.0) / PITCH for place in (lookup.u, lookup.v))
        self._node, self._below = np.zeros((2, face.size), dtype=np.intp)
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
                self._node[own] = patch.nodes.start + j * columns + i
                self._below[own] = self._node[own] + columns
                cell[own] = count + j * (columns - 1) + i
                self._along[own] = turned(turn.T, rays.all[:, own])[2]
                count += (rows - 1) * (columns - 1)
        self._right, self._down = u, v
        self._weights = _weights(u, v, self._along)
        self._pixels = np.argsort(cell, kind="stable")[np.count_nonzero(cell < 0) :]  # cell by cell
        self._first = np.searchsorted(cell[self._pixels], np.arange(count + 1))

    def nearness(self, place: Vector, turn: Floats) -> NDArray[np.float64]:
        """1 over the distance (m) of each pixel, 0 or less where there is no ground, NaN where the lens sees nothing.

        The camera is at a place (m; north, east, down); `turn` (3, 3) rotates its frame to NED.
        """
        lattice = self._lattice
        near, rough = self.relief.meet(place, turned(turn, lattice.rays), exact=True, cell=lattice.cell)
        found, close = np.empty(self._along.size), near.astype(np.float32)
        for start in range(0, found.size, BLOCK):
            part = slice(start, start + BLOCK)
            found[part] = _mixed(close, self._node[part], self._below[part], self._weights[:, part])
        cells = self._looked_over(near, rough)
        crooked = np.flatnonzero(cells.crooked)
        if not crooked.size:
            return found
        own, cell = self._within(crooked)
        along = self._along[own]
        for bend, place_in in zip(cells.bends, (self._right, self._down), strict=True):
            share = place_in[own]
            found[own] += bend[cell] * share * (share - 1.0) * along
        errs, guess = cells.bent[cell] * along, np.maximum(found[own], 0.0)
        cast = np.flatnonzero(errs > ERROR * guess)
        rays = turned(turn, self._rays.all[:, own[cast]])
        if place[2] <= self.relief.sea.shallowest:  # all ground is below
            down = rays[2] > 0.0
            found[own[cast[~down]]] = 0.0
            cast, rays = cast[down], rays[:, down]
        own, about = own[cast], (errs < NEARLY * guess)[cast]
        if about.any():
            closer, good = self.relief.settle(place, rays[:, about], found[own[about]])
            found[own[about]] = closer
            about[about] = good
        rest = np.flatnonzero(~about)
        if rest.size:
            found[own[rest]], _ = self.relief.meet(place, rays[:, rest], exact=True)
        return found

    def _looked_over(self, near: Floats, rough: NDArray[np.bool_]) -> Cells:
        found = [_cells(patch, near, rough) for patch in self._lattice.patches if min(patch.shape) > 1]
        return Cells(*(np.concatenate(each, axis=-1) for each in zip(*found, strict=True)))

    def _within(self, cells: Places) -> tuple[Places, Places]:
        """The pixels in cells, and the cell of each."""
        first, count = self._first[cells], self._first[cells + 1] - self._first[cells]
        start = np.cumsum(count) - count
        return self._pixels[np.arange(count.sum()) + np.repeat(first - start, count)], np.repeat(cells, count)


def _cells(patch: Patch, near: Floats, rough: NDArray[np.bool_]) -> Cells:
    """What interpolation does in the cells of a patch, by the nearness at all rays."""
    w = patch.of(near)
    straight, bent = np.zeros(w.shape), np.zeros(tuple(n - 1 for n in w.shape))
    bends: list[Floats] = []
    for axis in (1, 0):
        bend = second(w, axis)
        straight += np.abs(bend) / 8.0
        middle = corners(bend, np.add) / 4.0
        bends.append(middle.ravel() / 2.0)
        bent += np.maximum(corners(bend, np.maximum) - middle, middle - corners(bend, np.minimum)) / 8.0
    worst = corners(straight, np.maximum)
    bent[[0, -1]], bent[:, [0, -1]] = worst[[0, -1]], worst[:, [0, -1]]  # beyond the border it is not known
    given, most = corners(patch.of(rough), np.logical_or), ERROR * np.abs(w) + TINY
    return Cells(
        (given | (corners(straight / most, np.maximum) > 1.0)).ravel(),
        np.where(given, np.inf, bent).ravel(),
        np.stack(bends),
    )


def _weights(right: Floats, down: Floats, along: Floats) -> NDArray[np.float32]:
    """(4, n) shares of four nodes in what is between them: the upper two, and the lower two."""
    rows, columns = (along * (1.0 - down), along * down), (1.0 - right, right)
    return np.stack([row * column for row in rows for column in columns]).astype(np.float32)


def _mixed(near: Floats, node: Places, below: Places, weights: Floats) -> Floats:
    """Bilinear, from four nodes. What single precision rounds off is far less than ERROR."""
    found = near.take(node, mode="clip")
    found *= weights[0]
    for place, weight in zip((node + 1, below, below + 1), weights[1:], strict=True):
        more = near.take(place, mode="clip")
        more *= weight
        found += more
    return found
