"""Steers toward a point ahead."""

import math
from dataclasses import dataclass

from autonomy.guidance.track import PathProgress
from support.planar_geometry import bearing as bearing_between


@dataclass(frozen=True)
class PurePursuitGains:
    """Distance ahead at which the vehicle aims on a circle."""

    lookahead: float  # m


class PurePursuitLaw:
    """Steers toward the end of a straight track, or toward a point ahead on a circle."""

    def __init__(self, gains: PurePursuitGains):
        self._lookahead = gains.lookahead

    def line_course(self, where: PathProgress, bearing: float) -> float:
        return where.line_of_sight

    def circle_course(self, line_of_sight: float, distance: float, radius: float, side: int) -> float:
        outward = line_of_sight + math.pi
        ahead = outward + side * min(self._lookahead / radius, 0.5 * math.pi)
        here = distance * math.cos(outward), distance * math.sin(outward)
        return bearing_between(here, (radius * math.cos(ahead), radius * math.sin(ahead)))
