"""Rays on their way over a grid of depths, and where they cross it."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from support.rotations import Vector
from world.rendering.seabed.depth_clipmap import CurvedDepthGrid, DepthGrid

Floats = NDArray[np.floating[Any]]
Bools = NDArray[np.bool_]
Places = NDArray[np.intp]

STRIDE = 1.0  # cells of the grid between samples along a ray
SAMPLES, MOST_SAMPLES = 6, 24  # of each ray that are taken together: more, if there are few rays
TOGETHER = 6000  # samples of all rays, if they are few
TOUCH = 0.02  # of the bend of a crest, by which its height between samples is not known
NEARLY = 0.25  # of `cell` by which a ray may pass over a crest that the next ray meets
MOST = 6  # steps of false position
ABOUT = 2  # of these, to where a crossing of curves is near
CROSSED = 3e-5  # of the way, to which crossings are found
AGO = 0.98
FLATTEST = 1e-3
SLACK = 1e-9


class GroundRays(NamedTuple):
    """Rays from a place (m; north, east, down) that go `directions` (3, n), so far per unit of way, of any length.

    The ground is `lowered` m deeper to them than it is.
    """

    position: Vector
    directions: Floats
    lowered: float

    @property
    def down(self) -> Floats:
        return self.directions[2]

    @property
    def horizontal(self) -> Floats:
        """Distance (n,) that they cover across the ground."""
        return np.hypot(self.directions[0], self.directions[1])

    def subset(self, chosen: Places | slice) -> "GroundRays":
        own = self.directions[:, chosen] if isinstance(chosen, slice) else self.directions.take(chosen, axis=1)
        return GroundRays(self.position, own, self.lowered)

    def clearance(self, ground: Any, way: Floats) -> Floats:
        """Height (m) of the points (n, ...) above the ground after some way."""
        north, east, down = self.directions.reshape(3, -1, *(1,) * (way.ndim - 1)) * way
        n, e, d = self.position
        north += n
        east += e
        found: Floats = ground.depths(north.ravel(), east.ravel()).reshape(way.shape)
        found += self.lowered - d
        found -= down
        return found

    def curve_error(self, curved: CurvedDepthGrid, way: Floats) -> Floats:
        """Bound on the distance (m) of curves from the bottom at the points (n,) after some way."""
        n, e, _ = self.position
        return curved.errors_at(self.directions[0] * way + n, self.directions[1] * way + e)


class MarchSpans(NamedTuple):
    """Range of the way (n,) in which each ray may cross a grid, and which rays do so `once` at most.

    They go `horizontal` (n,) across the ground per unit of way.
    """

    first: Floats
    last: Floats
    once: Bools
    horizontal: Floats

    def subset(self, part: slice) -> "MarchSpans":
        return MarchSpans(self.first[part], self.last[part], self.once[part], self.horizontal[part])


class RayMarch:
    """Rays on their way over a grid, each on its leg.

    `crossing` (n,) is the way of each to its crossing, NaN without one; `descent` (n,) is how fast it comes down to the
    ground there; `crest` (n,) is the way to the first place where it nearly touched the ground before.
    """

    def __init__(self, rays: GroundRays, grid: DepthGrid, legs: MarchSpans):
        self.rays: GroundRays = rays
        self.grid: DepthGrid = grid
        self._legs = legs
        count = len(rays.down)
        self.crossing: Floats = np.full(count, np.nan)
        self.descent: Floats = np.ones(count)
        self.crest: Floats = np.full(count, np.inf)
        length = legs.last - legs.first
        steps = np.ceil(legs.horizontal * length / (STRIDE * grid.step))
        self._step = length / np.maximum(steps, 2.0)

    def hit_ray_indices(self) -> Places:
        return np.flatnonzero(np.isfinite(self.crossing))

    def find_crossings(self, cell: float, steps: int) -> None:
        """Find the crossings, by some steps of false position, and crests within NEARLY of a `cell`."""
        going, (starts, ends, *_) = np.arange(len(self.crossing)), self._legs
        way = starts
        clear = self.rays.clearance(self.grid, way)
        at_once = clear <= 0.0
        if at_once.any():
            self._begin_under(going[at_once], way[at_once], clear[at_once])
            going, way, clear = going[~at_once], way[~at_once], clear[~at_once]
        once = self._legs.once[going]
        if once.any():
            self._drop(going[once], way[once], clear[once], steps)
            going, way, clear = going[~once], way[~once], clear[~once]
        ways, clears, done = np.stack((way, way), axis=1), np.stack((clear, clear), axis=1), 1
        while going.size:
            rays, last = self.rays.subset(going), ends[going]
            places = np.arange(done, done + min(MOST_SAMPLES, max(SAMPLES, TOGETHER // going.size)))
            done += places.size
            more = starts[going][:, np.newaxis] + self._step[going][:, np.newaxis] * places
            np.minimum(more, last[:, np.newaxis], out=more)
            ways = np.concatenate((ways, more), axis=1)
            clears = np.concatenate((clears, rays.clearance(self.grid, more)), axis=1)
            hit = self._pass(going, rays, ways, clears, cell, steps)
            stay = ~hit & (ways[:, -1] < last)
            going, ways, clears = going[stay], ways[stay, -2:], clears[stay, -2:]

    def _begin_under(self, own: Places, way: Floats, clear: Floats) -> None:
        """Rays that begin under the ground: by no more than the difference of two grids."""
        before = self.rays.subset(own).clearance(self.grid, AGO * way)
        self.crossing[own] = way
        self.descent[own] = np.maximum((before - clear) / ((1.0 - AGO) * way + SLACK), FLATTEST)

    def _drop(self, own: Places, way: Floats, clear: Floats, steps: int) -> None:
        """Rays that are so steep that they come ever nearer to the ground."""
        rays, last = self.rays.subset(own), self._legs.last[own]
        after = rays.clearance(self.grid, last)
        hit = np.flatnonzero(after <= 0.0)
        if hit.size:
            span = way[hit], clear[hit], last[hit], after[hit]
            self.crossing[own[hit]], self.descent[own[hit]] = _false_position(rays.subset(hit), self.grid, steps, *span)

    def _pass(self, going: Places, rays: GroundRays, ways: Floats, clears: Floats, cell: float, steps: int) -> Bools:
        """Look for crossings among samples (n, m), and for crests that a ray may touch between them."""
        under = clears <= 0.0
        place = under.argmax(axis=1)
        place[~under.any(axis=1)] = ways.shape[1]
        rises = clears[:, 1:] >= clears[:, :-1]
        row, column = np.nonzero(rises[:, 1:] & ~rises[:, :-1])
        ahead = (column + 1 < place[row]) & (ways[row, column + 2] > ways[row, column + 1])
        row, column = row[ahead], column[ahead]
        if row.size:
            before, middle, after = (clears[row, column + n] for n in range(3))
            close = np.flatnonzero(middle < NEARLY * cell * ways[row, column + 1])[::-1]  # the first one is set last
            crests = self.crest[going[row[close]]]
            self.crest[going[row[close]]] = np.minimum(crests, ways[row[close], column[close] + 1])
            bend = before - 2.0 * middle + after
            near = middle < (after - before) ** 2 / (8.0 * bend) + TOUCH * bend
            row, column, bend, lean = row[near], column[near], bend[near], (before - after)[near]
            if row.size:
                spacing = ways[row, column + 1] - ways[row, column]
                top = ways[row, column + 1] + lean / (2.0 * bend) * spacing
                clear = rays.subset(row).clearance(self.grid, top)
                sunk = np.flatnonzero(clear <= 0.0)[::-1]  # the first crest of a ray is set last
                row, column = row[sunk], column[sunk] + 1
                ways[row, column], clears[row, column], place[row] = top[sunk], clear[sunk], column
        hit: Bools = place < ways.shape[1]
        rows = np.flatnonzero(hit)
        if rows.size:
            end = place[rows]
            span = ways[rows, end - 1], clears[rows, end - 1], ways[rows, end], clears[rows, end]
            way, falls = _false_position(rays.subset(rows), self.grid, steps, *span)
            self.crossing[going[rows]], self.descent[going[rows]] = way, falls
        return hit


def _false_position(
    rays: GroundRays, ground: Any, steps: int, low: Floats, above: Floats, high: Floats, below: Floats
) -> tuple[Floats, Floats]:
    """Ways to the crossings between low and high, where the ground is `above` > 0 >= `below`, and how fast it nears.

    A crossing does not depend on which rays are sought together.
    """
    falls = (above - below) / np.maximum(high - low, SLACK)
    result, left = low + (high - low) * (above / (above - below)), np.arange(len(low))
    way, enough = result, CROSSED * falls
    for _ in range(steps):
        clear = rays.clearance(ground, way)
        going = np.flatnonzero(np.abs(clear) > enough * way)
        if not going.size:
            break
        if going.size < clear.size:
            left, rays, clear, way, enough = left[going], rays.subset(going), clear[going], way[going], enough[going]
            low, above, high, below = low[going], above[going], high[going], below[going]
        over = clear > 0.0
        # The end that stays weighs half, so that it does not stay for long (Dowell and Jarratt 1971).
        low, high = np.where(over, way, low), np.where(over, high, way)
        above, below = np.where(over, clear, 0.5 * above), np.where(over, 0.5 * below, clear)
        below = np.minimum(below, -1e-300)
        way = low + (high - low) * (above / (above - below))
        result[left] = way
    return result, falls
