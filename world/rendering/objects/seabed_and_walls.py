"""Opaque parts of the world that do not move: the relief of the seabed, and walls."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from support.rotations import Vector
from world.objects import NorthEast
from world.rendering.seabed import SeabedIntersector
from world.sea import Bathymetry

Floats = NDArray[np.floating[Any]]
Bools = NDArray[np.bool_]

Wall = tuple[NorthEast, NorthEast]
"""North and east (m) of both ends."""

RestingBody = tuple[Floats, float, float]
"""Points (n, 3; m; north, east, down) of a body, how far it reaches below them, and how deep it can lie (m)."""

THINNEST = 1e-6  # m, from a wall, within which a camera is in it
LEEWAY = 0.01  # m, by which a height may differ from soundings and depth
SAME = 1e-6  # share of a distance, by which things at one place may seem apart


class SeabedAndWalls:
    """A seabed and vertical walls, which reach from the bottom to the surface; without soundings the bottom is flat."""

    def __init__(self, seabed: Bathymetry | None = None, walls: Sequence[Wall] = ()):
        self.relief: SeabedIntersector | None = (
            SeabedIntersector(seabed) if seabed is not None and seabed.has_soundings else None
        )
        self.walls: tuple[Wall, ...] = tuple(walls)

    def height_above_ground(self, north: float, east: float, down: float, flat: float) -> float:
        """Height (m) of a place above the bottom beneath it, which is `flat` without a relief."""
        return flat if self.relief is None else self.relief.sea.depth(north, east) - down

    def obstruction(self, place: Vector, flat: float) -> str:
        """Obstruction of a camera at a place (m; north, east, down), `flat` m above a flat bottom; else empty."""
        if not self.height_above_ground(*place, flat) > 0.0:
            return "the camera is in the ground"
        if any(_apart(wall, place) < THINNEST for wall in self.walls):
            return "the camera is in a wall"
        return ""

    def check_height(self, north: float, east: float, down: float, height: float) -> None:
        """Raises ValueError for a height (m) that is not that of a place above the relief beneath it."""
        true = self.height_above_ground(north, east, down, height)
        if abs(height - true) > LEEWAY:
            above = f"the seabed there is {true:g} m below the vehicle"
            raise ValueError(f"height = {height:g} m contradicts depth = {down:g} m: {above}")

    def inverse_wall_range(self, place: Vector, rays: Floats) -> Floats:
        """1 over the way (n,) of rays (3, n; NED per unit of way) to the nearest wall; 0 without one."""
        found = np.zeros(rays.shape[1])
        for wall in self.walls:
            np.maximum(found, inverse_range_to_wall(wall, place, rays), out=found)
        return found

    def occludes(self, place: Vector, rays: Floats, body: Floats, bed: float) -> Bools:
        """Mask of ground or a wall before a body, of nearness `body` (n,), with rays (3, n); see SeabedIntersector.

        The ground counts as `bed` m deeper; a flat bottom hides nothing.
        """
        found = (
            self.inverse_wall_range(place, rays) > body * (1.0 + SAME)
            if self.walls
            else np.zeros(len(body), dtype=np.bool_)
        )
        left = np.flatnonzero(~found & (body > 0.0))
        if self.relief is not None and left.size:
            until = 1.0 / body[left]
            near, _ = self.relief.intersect(place, rays.take(left, axis=1), exact=True, until=until, lowered=bed)
            found[left] = near > body[left] * (1.0 + SAME)
        return found

    def sink_depth(self, points: Floats, radius: float, deepest: float) -> float:
        """Depth (m) to which the ground gives way to a body that lies on it, with points (n, 3; m; north, east, down).

        That is as deep as the body reaches into it, `radius` m below its points; a body that lies deeper than
        `deepest` m is under the ground, which does not give way to it.
        """
        if self.relief is None:
            return 0.0
        sunk: float = max(down + radius - self.relief.sea.depth(north, east) for north, east, down in points.tolist())
        return sunk if 0.0 < sunk <= deepest else 0.0


def inverse_range_to_wall(wall: Wall, place: Vector, rays: Floats) -> Floats:
    """1 over the way (n,) of rays (3, n) to a wall; 0 where they miss it. It is linear in the direction of a ray."""
    (an, ae), (bn, be) = ((n - place[0], e - place[1]) for n, e in wall)
    wn, we = bn - an, be - ae
    aside = an * we - ae * wn
    if aside == 0.0:
        return 0.0 * rays[0]
    near: Floats = (rays[0] * we - rays[1] * wn) / aside
    share: Floats = (an * rays[1] - ae * rays[0]) / aside
    near *= (near > 0.0) & (share >= 0.0) & (share <= near)
    return near


def _apart(wall: Wall, place: Vector) -> float:
    """Distance (m) from a place to a wall."""
    (an, ae), (bn, be) = ((n - place[0], e - place[1]) for n, e in wall)
    wn, we = bn - an, be - ae
    share = max(0.0, min(1.0, -(an * wn + ae * we) / (wn * wn + we * we)))
    return math.hypot(an + share * wn, ae + share * we)
