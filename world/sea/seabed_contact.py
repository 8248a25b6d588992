"""Keeps a vehicle on or above the bottom of the sea."""

from typing import Protocol

from support.rotations import Vector
from world.sea.bathymetry import Bathymetry

# Assumed, without a source: the bottom holds as if a hull had half its weight in air as friction, for a bow that digs
# into the sediment, until it rises. Friction alone would hardly slow a vehicle that weighs nothing in water.
GRIP = 5.0  # m/s², deceleration on the bottom
TOUCH = 0.005  # m above the bottom, where a vehicle still feels it
TURNING = 0.5  # s, time constant of rotations on the bottom; assumed, too
STEP = 0.5  # m; a bottom that rises by more than this in one step is a wall
CLOSING = 5.0  # m/s; no vehicle sinks faster


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
        """Depth of the lowest point of the hull below `z` (m)."""
        ...

    @property
    def ground_velocity(self) -> Vector:
        """Velocity over ground (m/s; north, east, down)."""
        ...

    @ground_velocity.setter
    def ground_velocity(self, velocity: Vector) -> None: ...


class SeabedContact:
    """Stops a vehicle on the bottom, and before a wall at its last free place. The attributes are plain values.

    To save time, the depth is computed only where the bottom may be near.
    """

    def __init__(self) -> None:
        self._north = self._east = 0.0
        self._free = (0.0, 0.0)
        self._time = 0.0

    def reset(self, hull: Hull, north: float, east: float, sea: Bathymetry) -> None:
        """Begin anew with a vehicle whose reference is `north`, `east` (m) of that of the soundings."""
        self._north, self._east = north, east
        self._free, self._time = (hull.x, hull.y), 0.0
        hull.z = max(0.0, min(hull.z, sea.depth(north + hull.x, east + hull.y) - hull.draft))

    def apply(self, hull: Hull, sea: Bathymetry, h: float) -> float | None:
        """Apply the bottom after a step of `h` s; return the depth of the water (m) if the vehicle touches it."""
        self._time -= h
        if self._time > 0.0:
            return None
        here, keel = (hull.x, hull.y), hull.z + hull.draft + TOUCH
        north, east = self._north + hull.x, self._east + hull.y
        if keel < sea.shallowest:
            self._free, self._time = here, (sea.shallowest - keel) / CLOSING
            return None
        if sea.is_clear(north, east, keel):
            self._free = here
            return None
        water = sea.depth(north, east)
        if keel <= water:
            self._free = here
            return None
        if keel - water > STEP or water < hull.draft:
            hull.x, hull.y = self._free
            hull.ground_velocity = 0.0, 0.0, hull.ground_velocity[2]  # it may still rise along the wall
        else:
            self._free = here
            north, east, down = hull.ground_velocity
            if down < 0.0 and hull.z <= water - hull.draft:
                return water  # buoyancy or fins lift it, and nothing presses it on the bottom
            if hull.z > water - hull.draft:
                hull.z, down = water - hull.draft, min(0.0, down)
            speed = (north * north + east * east) ** 0.5
            left = max(0.0, 1.0 - GRIP * h / speed) if speed else 0.0
            hull.ground_velocity = left * north, left * east, down
        left = max(0.0, 1.0 - h / TURNING)
        hull.p, hull.q, hull.r = left * hull.p, left * hull.q, left * hull.r
        return water
