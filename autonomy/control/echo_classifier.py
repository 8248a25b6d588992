"""Classifies an echo from ahead."""

import math
from enum import Enum, auto

SURFACE = 0.2  # m; a shallower echo may be the surface
NOISE = 0.5  # m of an echo's height above the bottom


class EchoClass(Enum):
    """The surface, a bottom that can be climbed, or something in the way."""

    SURFACE = auto()
    BOTTOM = auto()
    OBSTACLE = auto()


def classify_echo(
    reach: float, depth: float, altitude: float, pitch: float, half_width: float, slope: float, arm: float = 0.0
) -> EchoClass:
    """Classify an echo at range `reach` (m) of a forward-looking sonar that opens `half_width` (rad) up and down.

    `depth` and `altitude` (m, negative if unknown) are the vehicle's, `pitch` (rad) is positive upwards. The sonar is
    `arm` (m) ahead of the center of the vehicle. A bottom that rises from below the vehicle by at most `slope` (rad) is
    not an obstacle.
    """
    nose = depth - arm * math.sin(pitch)
    if nose - reach * math.sin(pitch + half_width) < SURFACE:
        return EchoClass.SURFACE
    if altitude >= 0.0:
        lowest = nose - reach * math.sin(pitch - half_width)
        rise = depth + altitude - lowest
        if rise - NOISE <= math.tan(slope) * (arm + reach) * math.cos(pitch):
            return EchoClass.BOTTOM
    return EchoClass.OBSTACLE
