"""The area of OperationalLimits."""

from imc.messages import OperationalLimits, OpLimitsMask
from support.planar_geometry import along_and_across
from support.wgs84 import offset


def area_contains(limits: OperationalLimits, lat: float, lon: float, margin: float = 0.0) -> bool:
    """Whether a position (rad), and `margin` m around it, is in the area of the limits, if they have one.

    The area is the rectangle around `lat`, `lon` with `length` along `orientation`. A position that is not a number is
    outside.
    """
    if not limits.mask & OpLimitsMask.AREA:
        return True
    along, across = along_and_across(*offset(limits.lat, limits.lon, lat, lon), limits.orientation)
    return abs(along) + margin <= 0.5 * limits.length and abs(across) + margin <= 0.5 * limits.width
