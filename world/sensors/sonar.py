"""Distances along the beam of a sonar to the surface, the bottom, or a pier."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from world.attitude import Vector, rotation, to_ned

STEPS = 10
REFINEMENTS = 3


@dataclass(frozen=True)
class Beam:
    """A beam of a sonar: `start` is north, east, down in m, `direction` a unit vector."""

    start: Vector
    direction: Vector

    @classmethod
    def of(cls, place: Vector, angles: Vector, position: Vector, pan: float, tilt: float) -> "Beam":
        """The beam of a sonar at `position` (m, body) that points `pan` to starboard and `tilt` up (rad).

        `place` (m, north, east, down) and `angles` (rad) are those of the vehicle.
        """
        attitude = rotation(*angles)
        north, east, down = to_ned(attitude, position)
        forward = math.cos(tilt) * math.cos(pan), math.cos(tilt) * math.sin(pan), -math.sin(tilt)
        return cls((place[0] + north, place[1] + east, place[2] + down), to_ned(attitude, forward))

    def surface(self) -> float:
        """Distance (m) to the surface, 0 out of the water; infinite unless the beam points up."""
        depth, down = self.start[2], self.direction[2]
        return max(0.0, depth) / -down if down < 0.0 else math.inf

    def bottom(self, depth: Callable[[float, float], float], reach: float, shallowest: float = 0.0) -> float:
        """Distance (m) to a bottom of `depth` (north, east) within `reach`; infinite if the beam does not hit it.

        The whole bottom is at least `shallowest` m deep.
        """
        clear, down = shallowest - self.start[2], self.direction[2]
        if clear > 0.0 and clear >= reach * down:
            return math.inf
        first = near = clear / down if clear > 0.0 else 0.0
        over = self._above(depth, near)
        if over <= 0.0:
            return near
        for step in range(1, STEPS + 1):
            far = first + (reach - first) * step / STEPS
            under = self._above(depth, far)
            if under <= 0.0:
                return self._crossing(depth, near, over, far, under)
            near, over = far, under
        return math.inf

    def _crossing(
        self, depth: Callable[[float, float], float], near: float, over: float, far: float, under: float
    ) -> float:
        """Where the beam meets the bottom: by false position, and by bisection for a bottom with a step."""
        for attempt in range(2 * REFINEMENTS):
            share = 0.5 if attempt % 2 else over / (over - under)
            middle = near + share * (far - near)
            above = self._above(depth, middle)
            if above > 0.0:
                near, over = middle, above
            else:
                far, under = middle, above
        return near + over / (over - under) * (far - near)

    def wall(self, a: tuple[float, float], b: tuple[float, float]) -> float:
        """Distance (m) to a vertical wall between two points (north, east in m); infinite if the beam misses it."""
        (n, e, _), (dn, de, _) = self.start, self.direction
        wn, we = b[0] - a[0], b[1] - a[1]
        cross = dn * we - de * wn
        if cross == 0.0:
            return math.inf
        an, ae = a[0] - n, a[1] - e
        along, share = (an * we - ae * wn) / cross, (an * de - ae * dn) / cross
        return along if along >= 0.0 and 0.0 <= share <= 1.0 else math.inf

    def _above(self, depth: Callable[[float, float], float], distance: float) -> float:
        (north, east, down), (dn, de, dd) = self.start, self.direction
        return depth(north + distance * dn, east + distance * de) - (down + distance * dd)
