"""The rays through all pixels of a camera, and which pixels can see a body."""

import math

import numpy as np
from numpy.typing import NDArray

from world.optics import CameraModel, Floats
from world.rendering.objects.capsule import Capsule

Bools = NDArray[np.bool_]
Places = NDArray[np.intp]

TILES = 32  # across the longer side of a picture
NARROWEST = 8  # px, of a tile
SLACK = 1e-6  # rad, by which rounding may err


class PixelRays:
    """Unit rays (3, height * width; optical frame) through the pixel centers, row by row; NaN where there is none.

    Square tiles of pixels, each with the cone that holds its rays, show which pixels can see a body.
    """

    def __init__(self, optics: CameraModel):
        self.width: int = optics.width
        self.height: int = optics.height
        rays, covered = optics.pixel_rays()
        self.covered: Bools = covered.ravel()
        self.directions: Floats = np.ascontiguousarray(rays.reshape(-1, 3).T)
        side = max(NARROWEST, math.ceil(max(self.width, self.height) / TILES))
        self._tiles = _tiles(self.width, self.height, side)
        self._axes, self._angles = _cones(self.directions, self._tiles)
        self._rim = _rim(self._tiles, self.covered, self.width, self.height)

    def pixels_seeing(self, body: Capsule) -> tuple[Places, bool]:
        """The pixels that can see a body, and whether it can reach beyond what the picture shows."""
        balls = body.covering_balls()
        away = np.linalg.norm(balls, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            angle = np.arccos(np.clip(balls @ self._axes / away[:, None], -1.0, 1.0))
            reach = np.where(away > body.ball_radius, np.arcsin(np.minimum(1.0, body.ball_radius / away)), math.pi)
        seen = np.any(angle <= reach[:, None] + self._angles + SLACK, axis=0)
        pixels = self._tiles[seen].ravel()
        return pixels[pixels >= 0], bool(self._rim[seen].any()) or bool(np.any(reach > 1.0))


def _tiles(width: int, height: int, side: int) -> Places:
    """(tiles, side²) pixels of each tile, -1 beyond the picture."""
    rows, columns = math.ceil(height / side), math.ceil(width / side)
    pixels = np.full((rows * side, columns * side), -1, dtype=np.intp)
    pixels[:height, :width] = np.arange(height * width).reshape(height, width)
    return pixels.reshape(rows, side, columns, side).swapaxes(1, 2).reshape(rows * columns, side * side)


def _cones(rays: Floats, tiles: Places) -> tuple[Floats, Floats]:
    """Axes (3, tiles) and half angles (tiles, rad) of the cones that hold the rays; -infinity without any ray."""
    axes, angles = np.zeros((3, len(tiles))), np.full(len(tiles), -math.inf)
    axes[2] = 1.0
    for number, pixels in enumerate(tiles):
        own = rays[:, pixels[pixels >= 0]]
        own = own[:, np.isfinite(own[2])]
        if not own.size:
            continue
        middle = own.mean(axis=1)
        length = float(np.linalg.norm(middle))
        if length < 0.1:  # they look everywhere
            angles[number] = math.pi
            continue
        axes[:, number] = middle / length
        angles[number] = math.acos(max(-1.0, float((axes[:, number] @ own).clip(-1.0, 1.0).min())))
    return axes, angles


def _rim(tiles: Places, covered: Bools, width: int, height: int) -> Bools:
    """The tiles that touch the border of the picture, or of what the lens shows."""
    j, i = np.divmod(tiles, width)
    border = (tiles < 0) | (i == 0) | (j == 0) | (i == width - 1) | (j == height - 1)
    return np.any(border | ~covered[tiles], axis=1)
