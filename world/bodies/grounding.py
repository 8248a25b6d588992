"""Keeps a vehicle on or above the bottom of the sea."""

from collections.abc import Callable
from typing import Protocol

from world.attitude import Vector

GRIP = 5.0  # m/s², deceleration on the bottom; coefficient of friction 0.5
TURNING = 0.5  # s, time constant of rotations on the bottom
STEP = 0.5  # m; a bottom that rises by more than this between two looks is a wall
CLOSING = 5.0  # m/s; no vehicle approaches the bottom faster
FARTHEST = 0.5  # m that a vehicle may move between two looks where the bottom may rise


class Hull(Protocol):
    """A vehicle at `x`, `y`, `z` (m north, east, down) that turns with `p`, `q`, `r` (rad/s)."""

    x: float
    y: float
    z: float
    p: float
    q: float
    r: float

    @property
    def draft(self) -> float:
        """How far the hull reaches down from `z` (m)."""
        ...

    @property
    def over_ground(self) -> Vector:
        """Velocity over ground (m/s; north, east, down)."""
        ...

    @over_ground.setter
    def over_ground(self, velocity: Vector) -> None: ...


class Grounding:
    """Stops a vehicle on the bottom, and before a wall at its last free place. The attributes are plain values.

    To save time, the bottom is looked up only as often as the vehicle may have come near it.
    """

    def __init__(self) -> None:
        self._free = (0.0, 0.0)
        self._time = 0.0

    def place(self, x: float, y: float) -> None:
        """Begin anew at `x`, `y`."""
        self._free, self._time = (x, y), 0.0

    def hold(self, hull: Hull, depth: Callable[[float, float], float], shallowest: float, h: float) -> float | None:
        """Apply the bottom after a step of `h` s; return the depth of the water (m) if the vehicle touches it.

        `depth(x, y)` is that of the bottom (m), nowhere less than `shallowest`.
        """
        self._time -= h
        if self._time > 0.0:
            return None
        keel = hull.z + hull.draft
        if keel < shallowest:
            self._free, self._time = (hull.x, hull.y), (shallowest - keel) / CLOSING
            return None
        water = depth(hull.x, hull.y)
        if keel <= water:
            self._free, self._time = (hull.x, hull.y), min(water - keel, FARTHEST) / CLOSING
            return None
        if keel - water > STEP or water < hull.draft:
            hull.x, hull.y = self._free
            hull.over_ground = 0.0, 0.0, 0.0
        else:
            self._free = hull.x, hull.y
            hull.z = water - hull.draft
            north, east, down = hull.over_ground
            speed = (north * north + east * east) ** 0.5
            left = max(0.0, 1.0 - GRIP * h / speed) if speed else 0.0
            hull.over_ground = left * north, left * east, min(0.0, down)
        left = max(0.0, 1.0 - h / TURNING)
        hull.p, hull.q, hull.r = left * hull.p, left * hull.q, left * hull.r
        return water
