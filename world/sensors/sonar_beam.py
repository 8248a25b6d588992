"""Distances along the beam of a sonar to the surface, the bottom, a wall, or a body."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from support.rotations import Vector, rotation, to_ned
from support.vectors import dot

STEPS = 10
LEAST_LEVEL = 0.3  # m sideways per m, at least, for which steep beams count
ROUNDING = 0.01  # m beyond the deepest place, so that rounding does not lose it
REFINEMENTS = 12
LEAST_REFINEMENTS = 6
PRECISION = 0.01  # m


@dataclass(frozen=True)
class SonarBeam:
    """A beam of a sonar: `start` is north, east, down in m, `direction` a unit vector."""

    start: Vector
    direction: Vector

    @classmethod
    def from_vehicle(cls, place: Vector, angles: Vector, position: Vector, pan: float, tilt: float) -> "SonarBeam":
        """The beam of a sonar at `position` (m, body) that points `pan` to starboard and `tilt` up (rad).

        `place` (m, north, east, down) and `angles` (rad) are those of the vehicle.
        """
        attitude = rotation(*angles)
        north, east, down = to_ned(attitude, position)
        forward = math.cos(tilt) * math.cos(pan), math.cos(tilt) * math.sin(pan), -math.sin(tilt)
        return cls((place[0] + north, place[1] + east, place[2] + down), to_ned(attitude, forward))

    def distance_to_surface(self) -> float:
        """Distance (m) to the surface, 0 out of the water; infinite unless the beam points up."""
        depth, down = self.start[2], self.direction[2]
        return max(0.0, depth) / -down if down < 0.0 else math.inf

    def distance_to_bottom(
        self,
        depth: Callable[[float, float], float],
        reach: float,
        shallowest: float = 0.0,
        deepest: float = math.inf,
        stride: float = math.inf,
        shallowest_near: Callable[[float, float], float] | None = None,
    ) -> float:
        """Distance (m) to a bottom of `depth` (north, east) within `reach`; infinite if the beam does not hit it.

        The whole bottom is from `shallowest` to `deepest` m deep. What is two `stride` (m) wide is not missed.
        `shallowest_near`, which is quicker than `depth` and never more, changes nothing but the time that it takes.
        """
        clear, down = shallowest - self.start[2], self.direction[2]
        if clear > 0.0 and clear >= reach * down:
            return math.inf
        first = near = clear / down if clear > 0.0 else 0.0
        over = self._above(depth, near)
        if over <= 0.0:
            return near
        if down != 0.0:
            last = deepest + ROUNDING if down > 0.0 else shallowest - ROUNDING
            reach = min(reach, (last - self.start[2]) / down)
        level = max(LEAST_LEVEL, math.hypot(self.direction[0], self.direction[1]))
        most = min((reach - first) / STEPS, stride / level)
        is_known = True
        while near < reach:  # in small steps close to the bottom, which may be rough
            far = min(reach, near + min(most, max(over, 0.1 * stride) / level))
            if shallowest_near is not None:
                over_all = self._above(shallowest_near, far) - ROUNDING
                if over_all / level >= most:  # so the next step is the largest, however deep it is
                    near, over, is_known = far, over_all, False
                    continue
            under = self._above(depth, far)
            if under <= 0.0:
                return self._crossing(depth, near, over if is_known else self._above(depth, near), far, under)
            near, over, is_known = far, under, True
        return math.inf

    def _crossing(
        self, depth: Callable[[float, float], float], near: float, over: float, far: float, under: float
    ) -> float:
        """Intersection of the beam and the bottom: by false position, and by bisection for a bottom with a step."""
        for attempt in range(2 * REFINEMENTS):
            if attempt >= LEAST_REFINEMENTS and far - near < PRECISION:
                break
            share = 0.5 if attempt % 2 else over / (over - under)
            middle = near + share * (far - near)
            above = self._above(depth, middle)
            if above > 0.0:
                near, over = middle, above
            else:
                far, under = middle, above
        return near + over / (over - under) * (far - near)

    def distance_to_wall(self, a: tuple[float, float], b: tuple[float, float]) -> float:
        """Distance (m) to a vertical wall between two points (north, east in m); infinite if the beam misses it."""
        (n, e, _), (dn, de, _) = self.start, self.direction
        wn, we = b[0] - a[0], b[1] - a[1]
        cross = dn * we - de * wn
        if cross == 0.0:
            return math.inf
        an, ae = a[0] - n, a[1] - e
        along, share = (an * we - ae * wn) / cross, (an * de - ae * dn) / cross
        return along if along >= 0.0 and 0.0 <= share <= 1.0 else math.inf

    def distance_to_capsule(self, middle: Vector, heading: float, length: float, diameter: float) -> float:
        """Distance (m) to a level body with round ends; infinite if the beam misses it, 0 inside of it.

        `middle` is north, east, down, `length` includes the ends (m), `heading` is that of its axis (rad).
        """
        radius, half = 0.5 * diameter, 0.5 * (length - diameter)
        axis = math.cos(heading), math.sin(heading), 0.0
        (n, e, d), (dn, de, dd) = self.start, self.direction
        from_middle = n - middle[0], e - middle[1], d - middle[2]
        along, ahead = dot(axis, from_middle), dot(axis, self.direction)
        nearest = math.inf
        across = 1.0 - ahead * ahead
        if across > 1e-12:  # the side: where the part of the way that is square to the axis comes within the radius
            b = dot(from_middle, self.direction) - along * ahead
            span = _span(across, b, dot(from_middle, from_middle) - along * along - radius * radius)
            for distance in span:
                if abs(along + distance * ahead) <= half:
                    nearest = min(nearest, distance)
        for end in (-half, half):
            n, e, d = (off - end * part for off, part in zip(from_middle, axis, strict=True))
            span = _span(1.0, n * dn + e * de + d * dd, n * n + e * e + d * d - radius * radius)
            nearest = min((nearest, *span))
        inside = max(abs(along) - half, 0.0) ** 2 + dot(from_middle, from_middle) - along * along <= radius * radius
        return 0.0 if inside else nearest

    def _above(self, depth: Callable[[float, float], float], distance: float) -> float:
        (north, east, down), (dn, de, dd) = self.start, self.direction
        return depth(north + distance * dn, east + distance * de) - (down + distance * dd)


def _span(a: float, b: float, c: float) -> tuple[float, ...]:
    """The positive solutions of a t² + 2 b t + c = 0."""
    root = b * b - a * c
    if root < 0.0:
        return ()
    far, near = (-b + math.sqrt(root)) / a, (-b - math.sqrt(root)) / a
    return tuple(t for t in (near, far) if t >= 0.0)
