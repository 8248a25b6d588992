"""What an echo from ahead may be of."""

import math
from enum import Enum, auto

SURFACE = 0.2  # m; what is not deeper may be the surface
NOISE = 0.5  # m of an echo's height above the bottom


class Echo(Enum):
    """The surface, a bottom that can be climbed, or something in the way."""

    SURFACE = auto()
    BOTTOM = auto()
    OBSTACLE = auto()


def judge(reach: float, depth: float, altitude: float, pitch: float, half_width: float, slope: float) -> Echo:
    """What is seen at `reach` (m) by a sonar that looks ahead, `half_width` (rad) up and down.

    `depth` and `altitude` (m, negative if unknown) are the vehicle's, `pitch` (rad) is upwards. A bottom that rises by
    no more than `slope` (rad) from below the vehicle is no obstacle.
    """
    if depth - reach * math.sin(pitch + half_width) < SURFACE:
        return Echo.SURFACE
    if altitude >= 0.0:
        lowest = depth - reach * math.sin(pitch - half_width)
        rise = depth + altitude - lowest
        if rise - NOISE <= math.tan(slope) * reach * math.cos(pitch):
            return Echo.BOTTOM
    return Echo.OBSTACLE
