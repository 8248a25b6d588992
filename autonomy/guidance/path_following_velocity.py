"""Lines and circles in space, and the velocity that leads a multirotor along them."""

import math
from dataclasses import dataclass
from typing import NamedTuple

from support.planar_geometry import along_and_across
from support.rotations import Vector
from support.vectors import add, dot, limit_horizontal_and_vertical, norm


class MotionLimits(NamedTuple):
    """Limits of motion: speeds (m/s), acceleration of braking and turning (m/s²); `gain` (1/s) on distances."""

    speed: float
    climb: float
    descent: float
    acceleration: float
    gain: float

    def approach_speed(self, distance: float) -> float:
        """Approach speed (m/s) at a distance (m) from a point: slow enough to brake in time."""
        linear = self.acceleration / self.gain**2
        if distance <= linear:
            return self.gain * max(0.0, distance)
        return math.sqrt(2.0 * self.acceleration * (distance - 0.5 * linear))

    def limit_velocity(self, velocity: Vector) -> Vector:
        """The velocity, cut to the limits."""
        return limit_horizontal_and_vertical(velocity, self.speed, self.climb, self.descent)

    def velocity_to(self, offset: Vector) -> Vector:
        """Velocity to a point at an offset (m), to stop there."""
        distance = norm(offset)
        share = self.approach_speed(distance) / distance if distance > 0.0 else 0.0
        return self.limit_velocity((share * offset[0], share * offset[1], share * offset[2]))


@dataclass(frozen=True)
class Line:
    """A straight line from `start` to `end` (m north, east, down)."""

    start: Vector
    end: Vector

    @property
    def direction(self) -> Vector:
        """Unit vector from start to end; down for a line of length 0."""
        along = add(self.end, self.start, -1.0)
        length = norm(along)
        return (along[0] / length, along[1] / length, along[2] / length) if length > 0.0 else (0.0, 0.0, 1.0)

    @property
    def bearing(self) -> float:
        """Direction over ground (rad)."""
        return math.atan2(self.end[1] - self.start[1], self.end[0] - self.start[0])

    @property
    def horizontal_length(self) -> float:
        """Length over ground (m)."""
        return math.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1])

    def distance_to_end(self, at: Vector) -> float:
        """Distance (m) left along the line; negative beyond its end."""
        return dot(add(self.end, at, -1.0), self.direction)

    def offset_from(self, at: Vector) -> Vector:
        """Vector (m) from the nearest point of the line to a point."""
        return add(add(at, self.end, -1.0), self.direction, self.distance_to_end(at))

    def cross_track_distance(self, at: Vector) -> float:
        """Distance of a point to starboard of the line over ground (m); its distance from a vertical line."""
        north, east = at[0] - self.end[0], at[1] - self.end[1]
        if self.horizontal_length < 0.1:
            return math.hypot(north, east)
        return along_and_across(north, east, self.bearing)[1]

    def velocity(self, at: Vector, pace: MotionLimits) -> Vector:
        """Velocity along the line and back to it, to stop at its end."""
        left = self.distance_to_end(at)
        if left <= 0.0:
            return pace.velocity_to(add(self.end, at, -1.0))
        direction, beside = self.direction, self.offset_from(at)
        speed = min(pace.approach_speed(left), pace.speed)
        if direction[2]:
            speed = min(speed, (pace.descent if direction[2] > 0.0 else pace.climb) / abs(direction[2]))
        back = pace.velocity_to((-beside[0], -beside[1], -beside[2]))
        return pace.limit_velocity(add(back, direction, speed))


@dataclass(frozen=True)
class Circle:
    """A circle around `center` (m north, east, down) with a radius (m), clockwise from above (`side` 1) or not (-1)."""

    center: Vector
    radius: float
    side: int = 1

    def distance_outside(self, at: Vector) -> float:
        """Distance of a point outside the circle over ground (m); negative inside."""
        return math.hypot(at[0] - self.center[0], at[1] - self.center[1]) - self.radius

    def velocity(self, at: Vector, pace: MotionLimits) -> Vector:
        """Velocity around, and back to, the circle and its height; no faster than the vehicle can turn."""
        north, east, down = at[0] - self.center[0], at[1] - self.center[1], self.center[2] - at[2]
        distance = math.hypot(north, east)
        north, east = (north / distance, east / distance) if distance > 0.0 else (1.0, 0.0)
        speed = min(pace.speed, math.sqrt(pace.acceleration * self.radius))
        away = self.radius - distance
        outward = math.copysign(min(speed, pace.approach_speed(abs(away))), away)
        around = self.side * math.sqrt(max(0.0, speed * speed - outward * outward))
        vertical = math.copysign(pace.approach_speed(abs(down)), down)
        return pace.limit_velocity((outward * north - around * east, outward * east + around * north, vertical))
