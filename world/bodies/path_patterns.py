"""Paths of a simulated vehicle: smooth ramps, straight legs, circles."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Protocol

from support.planar_geometry import along_and_across, north_and_east
from support.rotations import wrap

PEAK_RATE = 1.875  # of a minimum-jerk ramp of one unit in one second
PEAK_ACCELERATION = 10.0 / math.sqrt(3.0)
SHORTEST = 2.0  # s, so that small changes do not jerk


class MinimumJerkRamp:
    """A value that moves to its target with minimum jerk; `value`, `rate` and `acceleration` are continuous.

    The quintic 10 s^3 - 15 s^4 + 6 s^5 of Flash and Hogan (1985); it never overshoots.
    """

    __slots__ = ("_duration", "_elapsed", "_origin", "_target", "acceleration", "moving", "rate", "value")

    def __init__(self, value: float):
        self.value: float = value
        self._origin = value
        self._target = value
        self.rate: float = 0.0
        self.acceleration: float = 0.0
        self.moving: bool = False
        self._duration = 1.0
        self._elapsed = 0.0

    def set_target(self, target: float, rate: float, acceleration: float) -> None:
        """Start to move from rest to `target`, with at most `rate` and `acceleration`."""
        distance = abs(target - self.value)
        self._origin, self._target, self._elapsed = self.value, target, 0.0
        self._duration = max(
            PEAK_RATE * distance / rate, math.sqrt(PEAK_ACCELERATION * distance / acceleration), SHORTEST
        )
        self.moving = True

    def advance(self, seconds: float) -> None:
        if not self.moving:
            return
        self._elapsed += seconds
        t, change = self._duration, self._target - self._origin
        s = self._elapsed / t
        if s >= 1.0:
            self.value, self.rate, self.acceleration, self.moving = self._target, 0.0, 0.0, False
            return
        self.value = self._origin + change * s * s * s * (10.0 + s * (6.0 * s - 15.0))
        self.rate = change / t * 30.0 * s * s * (1.0 - s) * (1.0 - s)
        self.acceleration = change / (t * t) * 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)


class Pattern(Protocol):
    """A path over ground."""

    @property
    def depth(self) -> float | None:
        """Depth (m) of the path here; None leaves it to the vehicle."""
        ...

    def guidance_course_and_curvature(self, north: float, east: float) -> tuple[float, float]:
        """Course over ground (rad) that leads onto the path from here (m), and the path's curvature (1/m)."""
        ...


class LinePattern:
    """An infinite straight line through `north`, `east` (m) at `course` (rad), joined within `lookahead` (m).

    Line-of-sight guidance: Fossen 2011, eq. 10.71.
    """

    depth: float | None = None

    def __init__(self, north: float, east: float, course: float, lookahead: float):
        self.north: float = north
        self.east: float = east
        self.course: float = course
        self.lookahead: float = lookahead

    def distance_along(self, north: float, east: float) -> float:
        return along_and_across(north - self.north, east - self.east, self.course)[0]

    def guidance_course_and_curvature(self, north: float, east: float) -> tuple[float, float]:
        _, across = along_and_across(north - self.north, east - self.east, self.course)
        return self.course - math.atan(across / self.lookahead), 0.0


class CirclePattern:
    """A circle to starboard around `north`, `east` with `radius`, joined within `lookahead` (all m)."""

    depth: float | None = None

    def __init__(self, north: float, east: float, radius: float, lookahead: float):
        self.north: float = north
        self.east: float = east
        self.radius: float = radius
        self.lookahead: float = lookahead

    def guidance_course_and_curvature(self, north: float, east: float) -> tuple[float, float]:
        dn, de = north - self.north, east - self.east
        outside = math.atan((math.hypot(dn, de) - self.radius) / self.lookahead)
        return math.atan2(de, dn) + 0.5 * math.pi + outside, math.cos(outside) / self.radius


class LegsPattern:
    """Straight legs through `points` (north, east and depth or None, in m), repeated from the first.

    A leg ends where a turn of `turn_radius` (m) leads onto the next one.
    """

    def __init__(self, points: Sequence[tuple[float, float, float | None]], turn_radius: float, lookahead: float):
        ends = [*points[1:], points[0]]
        self._legs: list[LinePattern] = []
        lengths: list[float] = []
        for (n, e, _), (to_n, to_e, depth) in zip(points, ends, strict=True):
            leg = LinePattern(n, e, math.atan2(to_e - e, to_n - n), lookahead)
            leg.depth = depth
            self._legs.append(leg)
            lengths.append(math.hypot(to_n - n, to_e - e))
        self._ends: list[float] = []
        for (leg, following), length in zip(pairwise([*self._legs, self._legs[0]]), lengths, strict=True):
            half_turn = min(0.5 * abs(wrap(following.course - leg.course)), 1.2)
            self._ends.append(length - min(turn_radius * math.tan(half_turn), 0.5 * length))
        self._index = 0

    @property
    def depth(self) -> float | None:
        return self._legs[self._index].depth

    def guidance_course_and_curvature(self, north: float, east: float) -> tuple[float, float]:
        leg = self._legs[self._index]
        if leg.distance_along(north, east) >= self._ends[self._index]:
            self._index = (self._index + 1) % len(self._legs)
            leg = self._legs[self._index]
        return leg.guidance_course_and_curvature(north, east)


def lawn_mower_corners(length: float, spacing: float, count: int, course: float) -> list[tuple[float, float, None]]:
    """Corners (north, east) of `count` legs of `length` at `course` (rad), `spacing` apart to starboard (m)."""
    forward = [(length if (i + 1) // 2 % 2 else 0.0, i // 2 * spacing) for i in range(2 * count)]
    return [(*north_and_east(along, across, course), None) for along, across in forward]


def parse_points(rows: Sequence[str], sizes: tuple[int, ...]) -> list[list[float]]:
    """Parse points, one row of space-separated numbers each. Raises ValueError that names the bad row."""
    points: list[list[float]] = []
    for row in rows:
        try:
            point = [float(word) for word in row.split()]
        except ValueError:
            point = []
        if len(point) not in sizes or not all(map(math.isfinite, point)):
            raise ValueError(f"{row!r} is not {' or '.join(map(str, sizes))} numbers")
        points.append(point)
    return points
