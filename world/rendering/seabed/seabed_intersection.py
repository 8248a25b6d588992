"""Intersection of rays with the bottom of the sea: marched over grids of depths, finer the nearer they are."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from support.rotations import Vector
from world.rendering.seabed.depth_clipmap import COARSER, CURVED, LEVELS, REACH, CurvedDepthGrid, DepthClipmap
from world.rendering.seabed.ray_hit_bounds import GridHorizon, HorizonSectors, sector_of_rays
from world.rendering.seabed.ray_march import ABOUT, MOST, NEARLY, SLACK, GroundRays, MarchSpans, RayMarch
from world.sea import Bathymetry

Floats = NDArray[np.floating[Any]]
Bools = NDArray[np.bool_]
Places = NDArray[np.intp]

BLOCK = 1 << 13  # rays that are marched together: their arrays fit into the L2 cache
BEHIND = 0.8  # a crest hides what is farther than its own way by this
STEEPER = 1.25  # times as steep as a grid, a ray comes down to it so fast that it crosses it once
CLOSE = 1e-7  # of the way, to which a ray is begun before a depth and ended after it
TRIES, CUTS = 4, 15
WIDER, CUT = np.array((1.0, 3.0, 7.0, 15.0)), np.arange(1, 16) / 16
NARROW = 2e-4  # of the way, to which crossings are found where the bottom is not smooth
SMOOTH = 2e-4  # of the way: a last step toward a crossing that is shorter leaves an error that is far smaller
SECANTS = 3  # toward a crossing that is about known
STRAYED = 0.12  # of the way, by which a crossing may be from where it was thought to be
OVER = 2.0  # cells beyond the reach of a grid, where its curves still hold
BEFORE = 0.98, 0.94  # shares of that way, at which a ray must be above the ground
AGO = 1e-3  # of the way, in which it is measured how fast a ray falls
TRUE = 3e-4  # of the way, by which a crossing of curves may be from that of the bottom
SURELY = 0.1  # of that: so near to the bottom are curves also where rays fall slower than they seemed to


class Crossings(NamedTuple):
    """Crossings of rays (n,): `way`, NaN without a crossing; how fast they `fall` there; on which `level` of the grids.

    `crest` is the way to the first place where they nearly touched the ground before.
    """

    way: Floats
    fall: Floats
    level: NDArray[np.int8]
    crest: Floats


class SeabedIntersector:
    """A bottom, for rays that start above it. It keeps grids for the next picture, which do not depend on the last."""

    def __init__(self, sea: Bathymetry):
        self.sea = sea
        self._grids, self._sectors = DepthClipmap(sea), HorizonSectors()
        self._horizons: dict[int, tuple[Vector, GridHorizon]] = {}

    def intersect(
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
        `reach` (m) it continues from there as deep as it is beneath the place. In the rough rays that are up to
        `cell` per unit of way beside may meet something nearer. `exact` crossings are those of the true bottom, others
        those of the grid. A crossing after the way `until` (n,) may be missed. The bottom lies `lowered` m deeper.
        """
        own = GroundRays(place, rays, lowered)
        level = (self.sea.default_depth if reach == math.inf else self.sea.depth(*place[:2])) + lowered - place[2]
        nearness = own.down / level if level > 0.0 else np.minimum(own.down, 0.0)
        if reach < math.inf:
            nearness = np.minimum(nearness, own.horizontal / reach)
        found = _crossings(len(nearness))
        self._march(own, reach, cell, until, exact, found)
        hit = np.flatnonzero(found.level >= 0)
        if exact and hit.size:
            found.way[hit] = self._true(own.subset(hit), found.way[hit], found.fall[hit], found.level[hit])
        nearness[hit] = 1.0 / found.way[hit]
        if not cell:
            return nearness, np.zeros(len(nearness), dtype=np.bool_)
        return nearness, (found.crest < math.inf) & (np.maximum(nearness, 1.0 / reach) < BEHIND / found.crest)

    def refine(self, place: Vector, rays: Floats, nearness: Floats) -> tuple[Floats, Bools]:
        """The nearness (n,) of rays of which one is about known, and which of them (n,) are found by that.

        It is that of the next crossing; the ground before it is looked at in a few places only.
        """
        own, found = GroundRays(place, rays, 0.0), nearness.copy()
        good, way = np.zeros(len(found), dtype=np.bool_), 1.0 / np.maximum(nearness, 1e-9)
        flat, begin = own.horizontal, 0.0
        away = flat * way
        for number in range(CURVED):
            end = REACH * COARSER**number
            every = np.flatnonzero((away >= begin) & (away < end) & (own.down > 0.0))
            begin = end
            for start in range(0, every.size, BLOCK):
                part, curved = every[start : start + BLOCK], self._grids.curved_grid_around(number, place)
                there, guess = own.subset(part), way[part]
                clear, fall = there.clearance(curved, guess), there.down
                after, sure = _secant(there, curved, guess, clear, guess + clear / fall, SECANTS)
                sure &= np.abs(after - guess) < STRAYED * guess
                sure &= flat[part] * after < end + OVER * curved.grid.step
                for share in BEFORE:
                    sure &= there.clearance(curved.grid, share * after) > 0.0
                with np.errstate(divide="ignore", invalid="ignore"):
                    sure &= _is_true(there, curved, after, clear / (after - guess))
                found[part[sure]], good[part] = 1.0 / after[sure], sure
        return found, good

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
                grid = self._grids.grid_around(number, place)
                n, e, half = points[0, own] + place[0], points[1, own] + place[1], grid.step / 2
                found[0, own] = (grid.depths(n + half, e) - grid.depths(n - half, e)) / grid.step
                found[1, own] = (grid.depths(n, e + half) - grid.depths(n, e - half)) / grid.step
        return found

    def _march(
        self, rays: GroundRays, reach: float, cell: float, until: Floats | None, exact: bool, found: Crossings
    ) -> None:
        """Fill in where rays cross the grids."""
        over = self.sea.shallowest + rays.lowered >= rays.position[2]
        left, begin = np.flatnonzero(rays.down > 0.0) if over else np.arange(len(rays.down)), 0.0
        flat = np.maximum(rays.horizontal, SLACK)
        for number in range(LEVELS):
            end = min(reach, REACH * COARSER**number)
            if not left.size or begin >= end:
                break
            last = end / flat[left] if until is None else np.minimum(end / flat[left], until[left])
            every, legs = self._legs(rays, number, left, flat, (begin / flat[left], last), cell)
            for start in range(0, every.size, BLOCK):
                part = slice(start, start + BLOCK)
                own = every[part]
                march = RayMarch(rays.subset(own), self._grids.grid_around(number, rays.position), legs.subset(part))
                march.find_crossings(cell, ABOUT if exact else MOST)
                found.crest[own] = np.minimum(found.crest[own], march.crest)
                hit = march.hit_ray_indices()
                own = own[hit]
                found.way[own], found.fall[own], found.level[own] = march.crossing[hit], march.descent[hit], number
            left = left[found.level[left] < 0]
            begin = end
            if until is not None:
                left = left[until[left] * flat[left] > end]

    def _legs(
        self, rays: GroundRays, number: int, own: Places, flat: Floats, ends: tuple[Floats, Floats], cell: float
    ) -> tuple[Places, MarchSpans]:
        """Places of some rays that may touch the grid of a level between two ways, and these spans.

        By `cell`, a ray touches what it nearly does.
        """
        grid = self._grids.grid_around(number, rays.position)
        top, bottom = (depth + rays.lowered - rays.position[2] for depth in (grid.shallowest, grid.deepest))
        lowest = rays.down[own] + NEARLY * cell
        near = np.flatnonzero(lowest * np.where(lowest < 0.0, *ends) >= top)
        own, (first, last) = own[near], (each[near] for each in ends)
        down, flat = rays.down[own], flat[own]
        with np.errstate(divide="ignore"):
            falling = bottom / down * (1.0 + CLOSE) + SLACK
            last = np.where(down > 0.0, np.minimum(last, falling), last)
            once = down > STEEPER * grid.steepest * flat
            first = np.where(once, np.maximum(first, top / down * (1.0 - CLOSE)), first)
        slant = np.flatnonzero(~once)
        if slant.size:
            there = own[slant]
            sector = sector_of_rays(rays.directions[0][there], rays.directions[1][there])
            horizon = self._horizon(number, rays.position)
            touch, nearest, farthest = horizon.possible_hits(sector, lowest[near[slant]] / flat[slant])
            first[slant[~touch]] = np.inf
            slant = slant[touch]
            first[slant] = np.maximum(first[slant], nearest / flat[slant])
            last[slant] = np.minimum(last[slant], farthest / flat[slant])
        going = np.flatnonzero(first < last)
        return own[going], MarchSpans(first[going], last[going], once[going], flat[going])

    def _horizon(self, number: int, place: Vector) -> GridHorizon:
        kept = self._horizons.get(number)
        if kept is None or kept[0] != place:
            kept = place, GridHorizon.from_grid(place, self._grids.grid_around(number, place), number, self._sectors)
            self._horizons[number] = kept
        return kept[1]

    def _true(self, rays: GroundRays, way: Floats, fall: Floats, level: NDArray[np.int8]) -> Floats:
        """Ways to the crossings of the true bottom next to those of grids: of curves, where these are near enough."""
        rest = [np.flatnonzero(level >= CURVED)]
        for number in range(CURVED):
            every = np.flatnonzero(level == number)
            for start in range(0, every.size, BLOCK):
                own = every[start : start + BLOCK]
                curved = self._grids.curved_grid_around(number, rays.position)
                there = rays.subset(own)
                found, good, _ = _stepped(curved, there, way[own], fall[own], SECANTS)
                way[own[good]] = found[good]
                good &= _is_true(there, curved, found, fall[own])
                rest.append(own[~good])
        own = np.concatenate(rest)
        if own.size:
            there = rays.subset(own)
            found, good, clear = _stepped(self.sea, there, way[own], fall[own])
            bad = np.flatnonzero(~good)
            if bad.size:
                found[bad] = _bracketed(self.sea, there.subset(bad), way[own[bad]], clear[bad], fall[own[bad]])
            way[own] = found
        return way


def _crossings(count: int) -> Crossings:
    """Crossings of rays that meet nothing."""
    none, never = np.full(count, np.nan), np.full(count, np.inf)
    return Crossings(none, np.ones(count), np.full(count, -1, np.int8), never)


def _is_true(rays: GroundRays, curved: CurvedDepthGrid, way: Floats, fall: Floats) -> Bools:
    """Whether crossings of curves are near those of the bottom, by how fast rays `fall` there, about."""
    error = rays.curve_error(curved, way)
    good: Bools = error < SURELY * TRUE * fall * way
    left = np.flatnonzero(~good)
    if left.size:
        good[left] = error[left] < TRUE * (rays.subset(left).clearance(curved, (1.0 - AGO) * way[left]) / AGO)
    return good


def _stepped(ground: Any, rays: GroundRays, way: Floats, falls: Floats, steps: int = 1) -> tuple[Floats, Bools, Floats]:
    """Ways to the crossings of a ground next to those of a grid, which ones are found, and how clear the latter are."""
    clear = rays.clearance(ground, way)
    found = way + clear / falls
    good: Bools = np.abs(found - way) < SMOOTH * way
    left = np.flatnonzero(~good)
    if left.size:
        nearer, good[left] = _secant(rays.subset(left), ground, way[left], clear[left], found[left], steps)
        found[left[good[left]]] = nearer[good[left]]
    return found, good, clear


def _secant(
    rays: GroundRays, ground: Any, way: Floats, clear: Floats, after: Floats, steps: int = 1
) -> tuple[Floats, Bools]:
    """Ways to the crossings of a ground by secants, from two ways and how clear the first is; which ones are found."""
    found, good, left = after.copy(), np.zeros(len(way), dtype=np.bool_), np.arange(len(way))
    for _ in range(steps):
        again = rays.clearance(ground, after)
        with np.errstate(divide="ignore", invalid="ignore"):
            nearer = after - again * (after - way) / (again - clear)
        near: Bools = np.abs(nearer - after) < SMOOTH * way
        found[left], good[left] = nearer, near
        going = np.flatnonzero(~near)
        if not going.size:
            break
        left, rays = left[going], rays.subset(going)
        way, clear = after[going], again[going]
        after = np.where(np.isfinite(nearer[going]), nearer[going], way)
    return found, good


def _bracketed(sea: Bathymetry, rays: GroundRays, way: Floats, clear: Floats, falls: Floats) -> Floats:
    """The same from a bracket that is sought around each crossing; without one it is left as it is."""
    low, high, rows = way.copy(), way.copy(), np.arange(len(way))
    step, over = np.maximum(2.0 * np.abs(clear) / falls, NARROW * way), clear > 0.0
    searching = rows
    # Outward from the estimate in growing steps, until the sign of the clearance changes.
    for _ in range(TRIES):
        if not searching.size:
            break
        ahead, begin = over[searching], np.where(over, high, low)[searching]
        more = np.where(ahead, step[searching], -step[searching])[:, np.newaxis] * WIDER
        ways = np.maximum(begin[:, np.newaxis] + more, 0.0)
        changed = (rays.subset(searching).clearance(sea, ways) > 0.0) != ahead[:, np.newaxis]
        found = changed.any(axis=1)
        which = np.where(found, changed.argmax(axis=1), WIDER.size - 1)
        last = np.take_along_axis(ways, which[:, np.newaxis], axis=1)[:, 0]
        ways = np.concatenate((begin[:, np.newaxis], ways), axis=1)
        before = np.take_along_axis(ways, np.where(found, which, which + 1)[:, np.newaxis], axis=1)[:, 0]
        low[searching], high[searching] = np.where(ahead, before, last), np.where(ahead, last, before)
        step[searching] *= 1.0 + WIDER[-1]
        searching = searching[~found]
    good = np.ones(len(way), dtype=np.bool_)
    good[searching] = False
    going = rows[good]
    # Cut the brackets; of several crossings the first one along the ray counts.
    for _ in range(CUTS):
        going = going[high[going] - low[going] > NARROW * high[going]]
        if not going.size:
            break
        span = high[going] - low[going]
        ways = low[going, np.newaxis] + span[:, np.newaxis] * CUT
        under = rays.subset(going).clearance(sea, ways) <= 0.0
        place = np.where(under.any(axis=1), under.argmax(axis=1), CUT.size)
        ends = np.concatenate((low[going, np.newaxis], ways, high[going, np.newaxis]), axis=1)
        low[going], high[going] = (np.take_along_axis(ends, (place + n)[:, np.newaxis], axis=1)[:, 0] for n in (0, 1))
    return np.where(good, 0.5 * (low + high), way)
