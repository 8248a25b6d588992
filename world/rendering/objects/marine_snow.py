"""Marine snow: flakes in the water around a camera, which stay where they are in the world but for a slow fall."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from world.rendering.cube_faces import Window

Floats = NDArray[np.floating[Any]]
Words = NDArray[np.uint64]

CELL = 0.5  # m, sides of the cubes of water whose flakes are drawn by lot together
FARTHEST = 3.0  # m from the camera
NEAREST = 0.08  # m
MOST = 20000  # flakes in one picture; where there are more, only the nearer ones are drawn
FADING = 0.8  # share of the reach from which on flakes fade
FALL = 1e-3  # m/s, 86 m a day; Alldredge and Gotschalk, Limnol. Oceanogr. 33 (1988), measured 74 on average
THINNEST, THICKEST = 0.5e-3, 5e-3  # m, diameter
SLOPE = 3.0  # of the numbers of flakes that are thicker, by diameter; Jackson and others, Deep-Sea Res. I 44 (1997)
BLURRED = 12.0  # px, largest radius of a flake
DRAWS = 4  # numbers for each flake: place and diameter
GOLDEN = 0x9E3779B97F4A7C15


class Flakes(NamedTuple):
    """`points` (3, n) in m, NED from the camera, `radii` (n,) in m, and `share` (n,) that is left of fading ones."""

    points: Floats
    radii: Floats
    share: Floats

    def subset(self, which: Any) -> "Flakes":
        return Flakes(self.points[:, which], self.radii[which], self.share[which])


class MarineSnow:
    """`density` flakes in a cubic meter of water; which ones, follows from the place and `seed` alone."""

    def __init__(self, density: float, seed: int = 0):
        self.density = density
        self.seed = seed
        self._cell: tuple[tuple[int, ...], tuple[Floats, Floats]] = (), (np.zeros((3, 0)), np.zeros(0))
        self.range: float = min(FARTHEST, (MOST / density * 0.75 / math.pi) ** (1.0 / 3.0))

    def flakes_around(self, north: float, east: float, depth: float, height: float, time: float) -> Flakes:
        """The flakes about a camera `depth` m below the surface and `height` m above the ground, at a time (s)."""
        middle = np.array([north, east, depth - FALL * time])
        places, radii = self._about(*np.floor(middle / CELL).astype(np.int64).tolist())
        points = places - middle[:, np.newaxis]
        away2, down = np.sum(points**2, axis=0), points[2]
        seen = np.flatnonzero(
            (away2 < self.range**2) & (away2 > NEAREST**2) & (down < height) & (down > -depth),
        )
        share = (1.0 - np.sqrt(away2[seen]) / self.range) / (1.0 - FADING)
        return Flakes(points[:, seen], radii[seen], np.minimum(share, 1.0))

    def _about(self, *cell: int) -> tuple[Floats, Floats]:
        """Places (3, n) in the falling water, and radii (n,), of all flakes that can be seen from within a cell.

        Those of the last cell are kept, since a camera stays in it for many pictures.
        """
        if cell != self._cell[0]:
            far = math.ceil(self.range / CELL) + 1
            axes = (np.arange(c - far, c + far + 1) for c in cell)
            cells = np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")])
            away2 = np.sum((cells - np.reshape(cell, (3, 1))) ** 2, axis=0) * CELL**2
            # Two cubes whose middles are that far apart are not nearer than the reach.
            self._cell = cell, self._in(cells[:, away2 < (self.range + math.sqrt(3.0) * CELL) ** 2])
        return self._cell[1]

    def _in(self, cells: NDArray[np.int64]) -> tuple[Floats, Floats]:
        """Places and radii of the flakes in cells (3, n)."""
        key = np.full(cells.shape[1], self.seed & 0xFFFFFFFF, np.uint64)
        for axis in cells.astype(np.uint64):
            key = _mixed(key ^ axis)
        count = self.density * CELL**3
        most = math.floor(count) + 1
        number = np.arange(most * DRAWS, dtype=np.uint64).reshape(most, 1, DRAWS) + np.uint64(1)
        drawn = _unit(_mixed(key[np.newaxis, :, np.newaxis] + number * np.uint64(GOLDEN)))
        there = np.arange(most)[:, np.newaxis] < count - _unit(_mixed(~key))
        which, cell = np.nonzero(there)
        x, y, z, size = drawn[which, cell].T
        diameter = np.minimum(THINNEST * (1.0 - size) ** (-1.0 / SLOPE), THICKEST)
        return (cells[:, cell] + np.stack((x, y, z))) * CELL, 0.5 * diameter


def draw_flakes(
    face: NDArray[np.uint8],
    turn: NDArray[np.float64],
    window: Window,
    flakes: Flakes,
    light: Floats,
) -> None:
    """Draw flakes of linear `light` (3, n) into a window of a face (w, w, 4), whose frame `turn` rotates to NED."""
    width = face.shape[0]
    x, y, z = turn.T @ flakes.points
    spread = z + 2.0 * BLURRED / width * z
    (shown,) = np.nonzero((z > 0.0) & (np.abs(x) < spread) & (np.abs(y) < spread))
    if not shown.size:
        return
    x, y, z = x[shown], y[shown], z[shown]
    column, row = ((v / z + 1.0) * (0.5 * width) - 0.5 for v in (x, y))
    radius = np.minimum(0.5 * width * flakes.radii[shown] / z, BLURRED)
    # A flake that is less than a pixel covers a share of one.
    thick = np.maximum(radius, 0.5)
    share = flakes.share[shown] * (radius / thick) ** 2
    places, covers, owners = list[NDArray[np.int64]](), list[Floats](), list[NDArray[np.intp]]()
    half = np.ceil(thick + 0.5).astype(np.int64)
    for size in np.unique(half).tolist():
        (own,) = np.nonzero(half == size)
        down, across = (a.ravel() for a in np.mgrid[-size : size + 1, -size : size + 1])
        i, j = (np.rint(v[own]).astype(np.int64)[:, np.newaxis] + a for v, a in ((row, down), (column, across)))
        far = np.hypot(i - row[own, np.newaxis], j - column[own, np.newaxis])
        cover = share[own, np.newaxis] * np.clip(thick[own, np.newaxis] + 0.5 - far, 0.0, 1.0)
        (top, bottom), (left, right) = window
        kept = (cover > 0.0) & (i >= top) & (i < bottom) & (j >= left) & (j < right)
        places.append((i * width + j)[kept])
        covers.append(cover[kept])
        owners.append(np.broadcast_to(own[:, np.newaxis], kept.shape)[kept])
    place, cover, owner = np.concatenate(places), np.concatenate(covers), np.concatenate(owners)
    _lay(face.reshape(-1, 4), place, cover, light[:, shown[owner]])


def _lay(pixels: NDArray[np.uint8], place: NDArray[np.int64], cover: Floats, light: Floats) -> None:
    """Cover pixels (n, 4) at places (m,) by shares (m,), each with its linear light (3, m)."""
    touched, own = np.unique(place, return_inverse=True)
    total = np.bincount(own, cover, len(touched))
    left, scale = np.maximum(1.0 - total, 0.0), 1.0 / np.maximum(total, 1.0)
    for channel, bright in enumerate(light):
        behind = (pixels[touched, channel] / 255.0) ** 2
        linear = behind * left + np.bincount(own, cover * bright, len(touched)) * scale
        pixels[touched, channel] = np.rint(255.0 * np.sqrt(np.minimum(linear, 1.0)))


def _mixed(words: Words) -> Words:
    """Words whose every bit depends on all bits of the given ones: SplitMix64 (Steele, Lea and Flood 2014)."""
    words = (words ^ (words >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    words = (words ^ (words >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return words ^ (words >> np.uint64(31))


def _unit(words: Words) -> Floats:
    """Numbers from 0 to 1, less than 1."""
    return (words >> np.uint64(11)) * 2.0**-53
