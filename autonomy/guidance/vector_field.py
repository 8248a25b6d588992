"""Steers along a vector field of courses that lead to a track."""

import math
from dataclasses import dataclass

from autonomy.guidance.track import PathProgress


@dataclass(frozen=True)
class VectorFieldGains:
    """The entry angle applies at the edge of the corridor."""

    corridor_width: float  # m from the track
    entry_angle: float  # rad


class VectorFieldLaw:
    """Steers at an angle that shrinks with the distance from the track (Nelson et al., IEEE T-RO 23(3), 2007)."""

    def __init__(self, gains: VectorFieldGains):
        self._gain = math.tan(gains.entry_angle) / gains.corridor_width

    def line_course(self, where: PathProgress, bearing: float) -> float:
        return bearing - math.atan(self._gain * where.y)

    def circle_course(self, line_of_sight: float, distance: float, radius: float, side: int) -> float:
        return math.pi + line_of_sight + side * (0.5 * math.pi + math.atan(2.0 * self._gain * (distance - radius)))
