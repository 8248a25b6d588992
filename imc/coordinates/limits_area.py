"""The area of OperationalLimits."""

import math

from imc.messages import OperationalLimits, OpLimitsMask
from support.planar_geometry import along_and_across
from support.wgs84 import displace, offset


def area_contains(limits: OperationalLimits, lat: float, lon: float, margin: float = 0.0) -> bool:
    """Whether a position (rad), and `margin` m around it, is in the area of the limits, if they have one.

    The area is the rectangle around `lat`, `lon` with `length` along `orientation`. A position that is not a number is
    outside.
    """
    if not limits.mask & OpLimitsMask.AREA:
        return True
    along, across = along_and_across(*offset(limits.lat, limits.lon, lat, lon), limits.orientation)
    return abs(along) + margin <= 0.5 * limits.length and abs(across) + margin <= 0.5 * limits.width


def area_corners(limits: OperationalLimits) -> list[tuple[float, float]]:
    """The corners of the area (rad), in the order around it; the mask is not considered."""
    cos, sin = math.cos(limits.orientation), math.sin(limits.orientation)
    half_length, half_width = 0.5 * limits.length, 0.5 * limits.width
    found: list[tuple[float, float]] = []
    for along, across in ((1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)):
        x, y = along * half_length, across * half_width
        lat, lon, _ = displace(limits.lat, limits.lon, 0.0, x * cos - y * sin, x * sin + y * cos)
        found.append((lat, lon))
    return found
