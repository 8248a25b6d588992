"""Bounds of the hits of rays on a grid of depths around a place: a profile of the depths in each direction."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from support.rotations import Vector
from world.rendering.seabed.depth_clipmap import COARSER, REACH, DepthGrid

Floats = NDArray[np.floating[Any]]
Bools = NDArray[np.bool_]
Places = NDArray[np.intp]

SECTORS = 256
RINGS = 64  # a cell wide; at the last one a sector is 1.6 cells wide, so that no part of it is a cell from its middle
EARLIER = 2  # rings, so that a ray is seen to come nearer to a crest before it passes it
NEARER = 1e-9  # of a ring, so that the ground right beneath the place does not count as infinitely steep
APART = 3.0  # between the profiles of two sectors, whose slopes are coded by numbers from -1 to 1


class HorizonSectors:
    """Parts of rings around a place: the middles of all, in cells north and east from it (SECTORS, RINGS)."""

    def __init__(self) -> None:
        bearings = (np.arange(SECTORS) + 0.5) * (math.tau / SECTORS)
        ways = np.arange(RINGS) + 0.5
        self.north: Floats = np.outer(np.cos(bearings), ways)
        self.east: Floats = np.outer(np.sin(bearings), ways)


def sector_of_rays(north: Floats, east: Floats) -> Places:
    """Sector of each ray (n,)."""
    found = np.arctan2(east, north) * (SECTORS / math.tau)
    return np.floor(found, out=found).astype(np.intp) % SECTORS


class GridHorizon(NamedTuple):
    """Range of rings of a grid in which a ray may touch it.

    `first` and `last` are profiles (SECTORS * rings): the least slope, down per m, at which a ray touches what is as
    near, or as far, as a ring; as numbers that grow.
    """

    step: float
    begin: int
    rings: int
    first: Floats
    last: Floats

    @classmethod
    def from_grid(cls, place: Vector, grid: DepthGrid, level: int, sectors: HorizonSectors) -> "GridHorizon":
        """Profiles of a grid of a level, around a place, where finer grids do not count."""
        begin = round(REACH * COARSER ** (level - 1) / grid.step) if level else 0
        x, y = ((at - start) / grid.step for at, start in zip(place[:2], (grid.north, grid.east), strict=True))
        corner = (sectors.north[:, begin:] + x).astype(np.intp)
        corner *= grid.columns
        corner += (sectors.east[:, begin:] + y).astype(np.intp)
        depth = grid.shallowest_nearby.take(corner)
        depth -= place[2]
        ends = grid.step * np.arange(begin, RINGS + 1)
        ends[0] += NEARER * grid.step
        slopes = np.where(depth > 0.0, depth / ends[1:], depth / ends[:-1])
        first = np.minimum.accumulate(slopes, axis=1)
        last = np.minimum.accumulate(slopes[:, ::-1], axis=1)[:, ::-1]
        more = APART * np.arange(SECTORS)[:, np.newaxis]
        return cls(grid.step, begin, RINGS - begin, (more - _squashed(first)).ravel(), (more + _squashed(last)).ravel())

    def possible_hits(self, sector: Places, slope: Floats) -> tuple[Bools, Floats, Floats]:
        """Mask of the rays (n,) of a slope, down per m, that may touch the grid; and their range of distances (m)."""
        more, squashed = APART * sector, _squashed(slope)
        start = sector * self.rings
        first = np.searchsorted(self.first, more - squashed) - start
        touch: Bools = first < self.rings
        own = np.flatnonzero(touch)
        last = np.searchsorted(self.last, more[own] + squashed[own], side="right") - start[own]
        first = np.maximum(first[own] - EARLIER, 0)
        return touch, (first + self.begin) * self.step, (last + self.begin) * self.step


def _squashed(slope: Floats) -> Floats:
    """Numbers from -1 to 1 that grow with slopes."""
    return slope / (1.0 + np.abs(slope))
