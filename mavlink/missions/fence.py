"""A fence as the area of OperationalLimits, and back."""

import math
from collections.abc import Sequence
from operator import mul

import imc
from mavlink.missions.enums import (
    FENCE_COMMANDS,
    GLOBAL,
    POSITIONS,
    MissionCommand,
    MissionError,
    MissionResult,
    MissionType,
)
from mavlink.missions.item import DEGREES, Item, check_position, to_float32
from mavlink.positions import degrees_e7
from support.planar_geometry import north_and_east
from support.wgs84 import displace, offset

CORNERS = 4
TOLERANCE = 0.5  # m by which a corner may be off a rectangle
PART = 0.005  # of the diagonal, by which it may be off as well: consoles draw large ones along meridians
SMALLEST = 1.0  # m
ADVICE = "the only fence is one inclusion polygon, a rectangle"
AREA = imc.OpLimitsMask.AREA
Offset = tuple[float, float]


def limits_with_fence(items: Sequence[Item], limits: imc.OperationalLimits | None = None) -> imc.OperationalLimits:
    """`limits` with the area of a fence; without items, with no area.

    The fence must be one inclusion polygon of 4 corners that form a rectangle to 0.5 m or 0.5 % of its diagonal; its
    length is from the first corner to the second. Raises BadItem.
    """
    limits = limits or imc.OperationalLimits()
    if not items:
        return limits.replace(mask=limits.mask & ~AREA, lat=0.0, lon=0.0, orientation=0.0, width=0.0, length=0.0)
    seq = 0
    try:
        for seq, item in enumerate(items):
            _check(item)
            if seq >= CORNERS:
                raise MissionError(MissionResult.NO_SPACE, f"is corner {seq + 1}; {ADVICE}")
        if len(items) < CORNERS:
            raise MissionError(MissionResult.INVALID, f"is the last of {len(items)} corners; {ADVICE}")
        return _rectangle(items, limits)
    except MissionError as error:
        raise error.for_item(seq, items[seq].command) from None


def fence_items(limits: imc.OperationalLimits) -> list[Item]:
    """The area of operational limits as a fence: its corners from its back left on, clockwise; none without an area."""
    numbers = (limits.lat, limits.lon, limits.orientation, limits.length, limits.width)
    if not limits.mask & AREA or not all(map(math.isfinite, numbers)) or not min(numbers[3:]) > 0.0:
        return []
    items: list[Item] = []
    for north, east in _corners(limits.orientation, limits.length, limits.width):
        lat, lon, _ = displace(limits.lat, limits.lon, 0.0, north, east)
        items.append(
            Item(
                GLOBAL,
                MissionCommand.NAV_FENCE_POLYGON_VERTEX_INCLUSION,
                param1=float(CORNERS),
                x=degrees_e7(lat),
                y=degrees_e7(lon),
                mission_type=MissionType.FENCE,
            )
        )
    return items


def _check(item: Item) -> None:
    if item.command == MissionCommand.NAV_RALLY_POINT or item.mission_type == MissionType.RALLY:
        raise MissionError(MissionResult.UNSUPPORTED, "rally points are not supported")
    if item.mission_type != MissionType.FENCE or item.command not in FENCE_COMMANDS:
        raise MissionError(MissionResult.UNSUPPORTED, "is not part of a fence")
    if item.command == MissionCommand.NAV_FENCE_RETURN_POINT:
        raise MissionError(MissionResult.UNSUPPORTED, "the vehicle returns to no point of a fence")
    if item.command != MissionCommand.NAV_FENCE_POLYGON_VERTEX_INCLUSION:
        raise MissionError(MissionResult.UNSUPPORTED, ADVICE)
    if item.frame not in POSITIONS:
        raise MissionError(MissionResult.UNSUPPORTED_FRAME, f"frame {item.frame} has no meaning for a fence")
    if item.param1 != CORNERS:
        raise MissionError(MissionResult.INVALID_PARAM1, f"its polygon has {item.param1:g} corners; {ADVICE}")
    check_position(item)


def _rectangle(items: Sequence[Item], limits: imc.OperationalLimits) -> imc.OperationalLimits:
    """The limits with the rectangle that is nearest to four corners. Raises MissionError if that is not near."""
    places = [(math.radians(item.x / DEGREES), math.radians(item.y / DEGREES)) for item in items]
    lat, lon = places[0]
    for _ in range(2):  # the first center is that of a map around a corner
        offsets = [offset(lat, lon, *place) for place in places]
        north, east = (math.fsum(axis) / CORNERS for axis in zip(*offsets, strict=True))
        lat, lon, _ = displace(lat, lon, 0.0, north, east)
    corners = [offset(lat, lon, *place) for place in places]
    ahead, right = _axis(corners, (-0.5, 0.5, 0.5, -0.5)), _axis(corners, (-0.5, -0.5, 0.5, 0.5))
    length, width = math.hypot(*ahead), math.hypot(*right)
    if min(length, width) < SMALLEST:
        raise MissionError(MissionResult.INVALID, f"a fence of {length:.1f} m by {width:.1f} m is too small")
    side = math.copysign(1.0, ahead[0] * right[1] - ahead[1] * right[0])
    # The least squares of all corners: a narrow fence gets its direction from the long sides.
    bearing = math.atan2(length * ahead[1] - side * width * right[0], length * ahead[0] + side * width * right[1])
    off = max(map(math.dist, corners, _corners(bearing, length, side * width)))
    if off > max(TOLERANCE, PART * math.hypot(length, width)):
        raise MissionError(MissionResult.INVALID, f"the polygon is off a rectangle by {off:.1f} m; {ADVICE}")
    return limits.replace(
        mask=limits.mask | AREA,
        lat=lat,
        lon=lon,
        orientation=to_float32(bearing),
        length=to_float32(length),
        width=to_float32(width),
    )


def _axis(corners: Sequence[Offset], weights: Sequence[float]) -> Offset:
    """The weighted sum of four offsets."""
    north, east = (math.fsum(map(mul, axis, weights)) for axis in zip(*corners, strict=True))
    return north, east


def _corners(bearing: float, length: float, width: float) -> list[Offset]:
    """Offsets (m) of the corners of a rectangle from its center: back left, front left, front right, back right."""
    ends = ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))
    return [north_and_east(x * length, y * width, bearing) for x, y in ends]
