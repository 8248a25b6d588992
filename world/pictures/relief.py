"""Where rays meet the bottom of the sea: marched over grids of its depths, which are finer the nearer they are."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from world.attitude import Vector
from world.sea import Bathymetry

Floats = NDArray[np.floating[Any]]
Bools = NDArray[np.bool_]
Places = NDArray[np.intp]

FINEST = 0.25  # m, between the depths of the first grid; each next one is COARSER times as coarse and as wide
COARSER = 4
REACH = 16.0  # m around the camera in which the first grid counts
LEVELS = 4
TILE = 32  # cells: grids consist of tiles at fixed places, so that a depth does not depend on where the camera was
STRIDE = 2.0  # cells of the grid between samples along a ray
SAMPLES = 6  # of each ray that are taken together
TOUCH = 0.02  # of the bend of a crest, by which its height between samples is not known
STEPS = 4  # of false position, between two samples
TRIES, HALVINGS = 14, 50
NEARLY = 0.25  # of `cell` by which a ray may pass over a crest that the next ray meets
BEHIND = 0.8  # a crest hides what is farther than its own way by this
CLOSE = 1e-7  # of the way, to which exact crossings are found where the bottom is not smooth
SMOOTH = 2e-4  # of the way: a last step towards a crossing that is shorter leaves an error that is far smaller
AGO = 0.98
FLATTEST = 1e-3
SLACK = 1e-9


class Grid(NamedTuple):
    """Depths (m) at nodes `step` m apart, from `north`, `east`; row by row of `columns`."""

    north: float
    east: float
    step: float
    nodes: Floats
    columns: int
    shallowest: float
    deepest: float

    def depths(self, north: Floats, east: Floats) -> Floats:
        """Bilinear."""
        x, y = (north - self.north) / self.step, (east - self.east) / self.step
        i, j = x.astype(np.intp), y.astype(np.intp)
        x -= i
        y -= j
        i *= self.columns
        i += j
        near, far = (self._across(corner, y) for corner in (i, i + self.columns))
        far -= near
        far *= x
        near += far
        return near

    def _across(self, corner: Places, share: Floats) -> Floats:
        left, right = self.nodes.take(corner, mode="clip"), self.nodes.take(corner + 1, mode="clip")
        right -= left
        right *= share
        left += right
        return left


class Rays(NamedTuple):
    """Rays from a place (m; north, east, down): `north`, `east`, `down` (n,) per unit of way, of any length."""

    place: Vector
    north: Floats
    east: Floats
    down: Floats
    lowered: float

    def at(self, chosen: Places) -> "Rays":
        return Rays(self.place, self.north[chosen], self.east[chosen], self.down[chosen], self.lowered)

    def clear(self, ground: Any, way: Floats) -> Floats:
        """How far (m) the ground is below the points (n, ...) after some way."""
        shape = (-1, *(1,) * (way.ndim - 1))
        north, east, down = (each.reshape(shape) for each in (self.north, self.east, self.down))
        n, e, d = self.place
        points = north * way + n, east * way + e
        found = ground.depths(*(np.ascontiguousarray(each).ravel() for each in points)).reshape(way.shape)
        found += self.lowered - d
        found -= down * way
        return found


class Relief:
    """A bottom, for rays that start above it. It keeps grids for the next picture, which do not depend on the last."""

    def __init__(self, sea: Bathymetry):
        self.sea = sea
        self._tiles: dict[tuple[int, int, int], Floats] = {}
        self._grids: dict[int, tuple[tuple[int, int, int, int], Grid]] = {}

    def meet(
        self,
        place: Vector,
        rays: Floats,
        reach: float = math.inf,
        *,
        exact: bool = False,
        cell: float = 0.0,
        until: Floats | None = None,
        lowered: float = 0.0,
    ) -> tuple[Floats, Bools]:
        """Nearness (n,), 1 over the way at which rays (3, n; NED, m per unit of way) meet the bottom; what is rough.

        Farther than the grids reach, the bottom is level; a ray that never meets it has a nearness of 0 or less. With a
        `reach` (m) it goes on from there as deep as it is beneath the place. In the rough rays that are up to
        `cell` per unit of way beside may meet something nearer. `exact` crossings are those of the true bottom, others
        those of the grid. A crossing after the way `until` (n,) may be missed. The bottom lies `lowered` m deeper.
        """
        own = Rays(place, rays[0], rays[1], rays[2], lowered)
        level = (self.sea.elsewhere if reach == math.inf else self.sea.depth(*place[:2])) + lowered - place[2]
        nearness = own.down / level if level > 0.0 else np.minimum(own.down, 0.0)
        if reach < math.inf:
            nearness = np.minimum(nearness, np.hypot(own.north, own.east) / reach)
        crest = np.full(len(nearness), np.inf)
        left, begin = np.arange(len(nearness)), 0.0
        for number in range(LEVELS):
            end = min(reach, REACH * COARSER**number)
            if not left.size or begin >= end:
                break
            grid = self._grid(number, place)
            march = _March(own.at(left), grid, begin, end, None if until is None else until[left])
            march.go(cell)
            hit = march.hits()
            if exact and hit.size:
                march.low[hit] = _exact(self.sea, own.at(left[hit]), march.low[hit], march.falls[hit])
            nearness[left[hit]] = 1.0 / march.low[hit]
            crest[left] = np.minimum(crest[left], march.crest)
            left, begin = np.delete(left, hit), end
            if until is not None:
                left = left[until[left] * np.hypot(own.north[left], own.east[left]) > end]
        return nearness, (crest < math.inf) & (np.maximum(nearness, 1.0 / reach) < BEHIND / crest)

    def slopes(self, place: Vector, points: Floats, reach: float) -> Floats:
        """(2, n) slopes of the bottom, down per m north and east, at points (3, n; m, NED from a place).

        Farther than `reach` m they are 0.
        """
        found = np.zeros((2, points.shape[1]))
        away, begin = np.hypot(points[0], points[1]), 0.0
        for number in range(LEVELS):
            end = min(reach, REACH * COARSER**number)
            own = np.flatnonzero((away >= begin) & (away < end))
            begin = end
            if own.size:
                grid = self._grid(number, place)
                n, e, half = points[0, own] + place[0], points[1, own] + place[1], grid.step / 2
                found[0, own] = (grid.depths(n + half, e) - grid.depths(n - half, e)) / grid.step
                found[1, own] = (grid.depths(n, e + half) - grid.depths(n, e - half)) / grid.step
        return found

    def _grid(self, number: int, place: Vector) -> Grid:
        """The grid of a level around a place."""
        step = FINEST * COARSER**number
        side, reach = step * TILE, REACH * COARSER**number + 2.0 * step
        first = [math.floor((middle - reach) / side) for middle in place[:2]]
        last = [math.floor((middle + reach) / side) + 1 for middle in place[:2]]
        wanted = first[0], first[1], last[0], last[1]
        kept = self._grids.get(number)
        if kept is not None and kept[0] == wanted:
            return kept[1]
        rows, columns = (TILE * (b - a) for a, b in zip(first, last, strict=True))
        nodes, tiles = np.empty((rows, columns)), dict[tuple[int, int, int], Floats]()
        for i in range(first[0], last[0]):
            for j in range(first[1], last[1]):
                key = number, i, j
                found = self._tiles.get(key)
                tiles[key] = found = self._tile(key, step) if found is None else found
                row, column = TILE * (i - first[0]), TILE * (j - first[1])
                nodes[row : row + TILE, column : column + TILE] = found
        self._tiles = {key: tile for key, tile in self._tiles.items() if key[0] != number} | tiles
        grid = Grid(
            first[0] * side, first[1] * side, step, nodes.ravel(), columns, float(nodes.min()), float(nodes.max())
        )
        self._grids[number] = wanted, grid
        return grid

    def _tile(self, key: tuple[int, int, int], step: float) -> Floats:
        _, i, j = key
        places = np.arange(TILE) * step
        north, east = np.meshgrid(places + i * TILE * step, places + j * TILE * step, indexing="ij")
        return self.sea.depths(north.ravel(), east.ravel()).reshape(TILE, TILE)


class _March:
    """Rays on their way over a grid, from `begin` to `end` m around the camera.

    `low` (n,) is the way of each to its crossing, NaN without one; `falls` (n,) is how fast it comes down to the ground
    there; `crest` (n,) is the way to the first place where it nearly touched the ground before.
    """

    def __init__(self, rays: Rays, grid: Grid, begin: float, end: float, until: Floats | None):
        self.rays, self.grid = rays, grid
        count = len(rays.down)
        self.low, self.falls = np.full(count, np.nan), np.ones(count)
        self.crest = np.full(count, np.inf)
        flat = np.maximum(np.hypot(rays.north, rays.east), SLACK)
        top, bottom = (depth + rays.lowered - rays.place[2] for depth in (grid.shallowest, grid.deepest))
        first, last = begin / flat, end / flat
        with np.errstate(divide="ignore", invalid="ignore"):
            if top > 0.0:
                first = np.where(rays.down > 0.0, np.maximum(first, top / rays.down * (1.0 - CLOSE)), np.inf)
            else:
                last = np.where(rays.down < 0.0, np.minimum(last, top / rays.down), last)
            falling = bottom / rays.down * (1.0 + CLOSE) + SLACK
            last = np.where(rays.down > 0.0, np.minimum(last, falling), last)
        if until is not None:
            last = np.minimum(last, until)
        self._first, self._last = first, last
        with np.errstate(invalid="ignore"):
            steps = np.ceil(flat * (last - first) / (STRIDE * grid.step))
            self._step = (last - first) / np.maximum(steps, 2.0)

    def hits(self) -> Places:
        return np.flatnonzero(np.isfinite(self.low))

    def go(self, cell: float) -> None:
        going = np.flatnonzero(self._first < self._last)
        way = self._first[going]
        clear = self.rays.at(going).clear(self.grid, way)
        ways, clears = np.stack((way, way), axis=1), np.stack((clear, clear), axis=1)
        at_once = clear <= 0.0
        if at_once.any():  # by no more than the difference of two grids
            own, there = going[at_once], way[at_once]
            before = self.rays.at(own).clear(self.grid, AGO * there)
            self.low[own] = there
            self.falls[own] = np.maximum((before - clear[at_once]) / ((1.0 - AGO) * there + SLACK), FLATTEST)
        going, ways, clears = going[~at_once], ways[~at_once], clears[~at_once]
        while going.size:
            rays, step, last = self.rays.at(going), self._step[going], self._last[going]
            more = ways[:, 1:] + step[:, np.newaxis] * np.arange(1, SAMPLES + 1)
            np.minimum(more, last[:, np.newaxis], out=more)
            ways = np.concatenate((ways, more), axis=1)
            clears = np.concatenate((clears, rays.clear(self.grid, more)), axis=1)
            hit = self._pass(going, rays, ways, clears, cell)
            stay = ~hit & (ways[:, -1] < last)
            going, ways, clears = going[stay], ways[stay, -2:], clears[stay, -2:]

    def _pass(self, going: Places, rays: Rays, ways: Floats, clears: Floats, cell: float) -> Bools:
        """Look for crossings among samples (n, m), and for crests that a ray may touch between them."""
        under = clears <= 0.0
        place = under.argmax(axis=1)
        place[~under.any(axis=1)] = ways.shape[1]
        rises = clears[:, 1:] >= clears[:, :-1]
        row, column = np.nonzero(rises[:, 1:] & ~rises[:, :-1])
        ahead = column + 1 < place[row]
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
                clear = rays.at(row).clear(self.grid, top)
                sunk = np.flatnonzero(clear <= 0.0)[::-1]  # the first crest of a ray is set last
                row, column = row[sunk], column[sunk] + 1
                ways[row, column], clears[row, column], place[row] = top[sunk], clear[sunk], column
        hit: Bools = place < ways.shape[1]
        rows = np.flatnonzero(hit)
        if rows.size:
            end = place[rows]
            span = ways[rows, end - 1], clears[rows, end - 1], ways[rows, end], clears[rows, end]
            way, falls = _false_position(rays.at(rows), self.grid, *span)
            self.low[going[rows]], self.falls[going[rows]] = way, falls
        return hit


def _false_position(
    rays: Rays, ground: Any, low: Floats, above: Floats, high: Floats, below: Floats
) -> tuple[Floats, Floats]:
    """Ways to the crossings between low and high, where the ground is `above` > 0 >= `below`, and how fast it nears."""
    falls = (above - below) / np.maximum(high - low, SLACK)
    for _ in range(STEPS):
        way = low + (high - low) * (above / (above - below))
        clear = rays.clear(ground, way)
        over = clear > 0.0
        # The end that stays weighs half, so that it does not stay for long (Dowell and Jarratt 1971).
        low, high = np.where(over, way, low), np.where(over, high, way)
        above, below = np.where(over, clear, 0.5 * above), np.where(over, 0.5 * below, clear)
        below = np.minimum(below, -1e-300)
    return low + (high - low) * (above / (above - below)), falls


def _exact(sea: Bathymetry, rays: Rays, way: Floats, falls: Floats) -> Floats:
    """Ways to the crossings of the true bottom next to those of a grid."""
    clear = rays.clear(sea, way)
    found = way + clear / falls
    left = np.flatnonzero(~(np.abs(found - way) < SMOOTH * way))
    if not left.size:
        return found
    rays, way, clear, falls, after = rays.at(left), way[left], clear[left], falls[left], found[left]
    again = rays.clear(sea, after)
    with np.errstate(divide="ignore", invalid="ignore"):
        nearer = after - again * (after - way) / (again - clear)
    good = np.isfinite(nearer) & (np.abs(nearer - after) < SMOOTH * way)
    found[left[good]] = nearer[good]
    bad = np.flatnonzero(~good)
    if bad.size:
        found[left[bad]] = _bisected(sea, rays.at(bad), way[bad], clear[bad], falls[bad])
    return found


def _bisected(sea: Bathymetry, rays: Rays, way: Floats, clear: Floats, falls: Floats) -> Floats:
    """The same from a bracket that is sought around each crossing; without one it is left as it is."""
    low, high = way.copy(), way.copy()
    step = np.maximum(2.0 * np.abs(clear) / falls, 1e-5 * way)
    searching = np.arange(len(way))
    over = clear > 0.0
    for _ in range(TRIES):
        if not searching.size:
            break
        ahead = over[searching]
        own = np.where(ahead, high[searching] + step[searching], np.maximum(low[searching] - step[searching], 0.0))
        now = rays.at(searching).clear(sea, own) > 0.0
        high[searching] = np.where(ahead, own, high[searching])
        low[searching] = np.where(ahead, low[searching], own)
        still = now == ahead
        inner = searching[still]
        low[inner], high[inner] = (
            np.where(over[inner], own[still], low[inner]),
            np.where(over[inner], high[inner], own[still]),
        )
        step[searching] *= 2.0
        searching = inner
    found = np.ones(len(way), dtype=np.bool_)
    found[searching] = False
    going = np.flatnonzero(found)
    for _ in range(HALVINGS):
        going = going[high[going] - low[going] > CLOSE * high[going]]
        if not going.size:
            break
        middle = 0.5 * (low[going] + high[going])
        over = rays.at(going).clear(sea, middle) > 0.0
        low[going], high[going] = np.where(over, middle, low[going]), np.where(over, high[going], middle)
    return np.where(found, 0.5 * (low + high), way)
