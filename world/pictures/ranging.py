"""Exact distances from a camera to the relief of the seabed, for all pixels of its picture."""

import numpy as np
from numpy.typing import NDArray

from world.attitude import Vector
from world.optics import CameraModel, Floats
from world.pictures.faces import rotations
from world.pictures.lattice import PITCH, TINY, Lattice, turned
from world.pictures.lookup import Lookup, finest_face
from world.pictures.rays import Rays
from world.pictures.relief import Relief

FACES = 6
ERROR = 1e-4  # share of a distance that may be wrong where it is interpolated between rays
FINER = 2, 4  # parts of a side into which cells are divided whose error is 4 or 16 times as large
BLOCK = 1 << 14  # pixels per step: their arrays fit into the L2 cache


class Ranging:
    """Distances to a relief: by a lattice of rays, finer where the ground bends, and by pixels where it is rough."""

    def __init__(self, optics: CameraModel, rays: Rays, relief: Relief):
        self.relief, self._rays = relief, rays
        self._width, self._turns = finest_face(optics), rotations(FACES)
        lookup = Lookup(optics, self._width, FACES)
        self._lattice = lattice = Lattice(self._width, self._turns, list(zip(lookup.rows, lookup.columns, strict=True)))
        self.seen = np.flatnonzero(rays.covered)
        face = lookup.face.ravel()[self.seen]
        u, v = (place.ravel()[self.seen] / PITCH for place in (lookup.u, lookup.v))
        self._node, self._below, self._cell = np.empty((3, self.seen.size), dtype=np.intp)
        self._along = np.empty(self.seen.size)
        cells = [np.empty((3, 0), dtype=np.intp)]  # face, first column and first row of each
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
                self._cell[own] = count + j * (columns - 1) + i
                self._along[own] = turned(turn.T, rays.all[:, self.seen[own]])[2]
                y, x = np.mgrid[: rows - 1, : columns - 1].reshape(2, -1)
                cells.append(np.stack((np.full(y.size, number), x + patch.column, y + patch.row)))
                count += y.size
        self._cells = np.concatenate(cells, axis=1)
        self._right, self._down = u, v

    def nearness(self, place: Vector, turn: Floats) -> NDArray[np.float64]:
        """1 over the distance (m) of each pixel in `seen`, 0 or less where there is no ground.

        The camera is at a place (m; north, east, down); `turn` (3, 3) rotates its frame to NED.
        """
        lattice = self._lattice
        near, rough = self.relief.meet(place, turned(turn, lattice.rays), exact=True, cell=lattice.cell)
        found = np.empty(self.seen.size)
        for start in range(0, found.size, BLOCK):
            part = slice(start, start + BLOCK)
            mixed = _mixed(near, self._node[part], self._below[part], self._right[part], self._down[part])
            np.multiply(mixed, self._along[part], out=found[part])
        errors = lattice.errors(near, rough, ERROR * np.abs(near) + TINY, -np.inf)
        worst = np.concatenate([error.ravel() for error in errors])
        if not np.any(worst > 1.0):
            return found
        worst = worst.take(self._cell)
        least = 1.0
        for parts in FINER:
            own = np.flatnonzero((worst > least) & (worst <= parts * parts))
            least = float(parts * parts)
            if own.size:
                found[own] = self._refined(place, turn, own, parts)
        own = np.flatnonzero(worst > least)
        if own.size:
            found[own], _ = self.relief.meet(place, turned(turn, self._rays.all[:, self.seen[own]]), exact=True)
        return found

    def _refined(self, place: Vector, turn: Floats, own: NDArray[np.intp], parts: int) -> Floats:
        """The nearness of some pixels by a lattice that is as many times as fine."""
        cells, cell = np.unique(self._cell[own], return_inverse=True)
        face, *first = self._cells[:, cells]
        fine = np.arange(parts + 1) / parts
        x, y = (2.0 * PITCH * (start[:, np.newaxis] + fine) + 1.0 for start in first)
        shape = len(cells), parts + 1, parts + 1
        tangents = (np.broadcast_to(each, shape) / self._width - 1.0 for each in (x[:, np.newaxis], y[..., np.newaxis]))
        grid = np.stack((*tangents, np.ones(shape)))
        rays = np.empty((3, *shape))
        for number in np.unique(face).tolist():
            rays[:, face == number] = turned(turn, turned(self._turns[number], grid[:, face == number]))
        near, _ = self.relief.meet(place, rays.reshape(3, -1), exact=True)
        (right, i), (down, j) = (self._within(share[own] * parts, parts) for share in (self._right, self._down))
        node = (cell * (parts + 1) + j) * (parts + 1) + i
        return _mixed(near, node, node + parts + 1, right, down) * self._along[own]

    @staticmethod
    def _within(places: Floats, parts: int) -> tuple[Floats, NDArray[np.intp]]:
        first = np.clip(np.floor(places).astype(np.intp), 0, parts - 1)
        return places - first, first


def _mixed(near: Floats, node: NDArray[np.intp], below: NDArray[np.intp], right: Floats, down: Floats) -> Floats:
    """Bilinear, from four nodes."""
    top, bottom = (_across(near, each, right) for each in (node, below))
    bottom -= top
    bottom *= down
    top += bottom
    return top


def _across(near: Floats, node: NDArray[np.intp], share: Floats) -> Floats:
    left, right = near.take(node, mode="clip"), near.take(node + 1, mode="clip")
    right -= left
    right *= share
    left += right
    return left
