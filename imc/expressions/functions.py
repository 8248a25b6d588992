"""The functions of numbers, and the distance between positions of messages."""

import math
from collections.abc import Callable, Mapping
from functools import lru_cache
from types import MappingProxyType
from typing import Any, NamedTuple

import imc
from support.rotations import wrap
from support.wgs84 import SEMI_MAJOR_AXIS, displacement


class ExpressionFunction(NamedTuple):
    """A function of numbers: how many it takes (at least, at most), and whether its result has the unit of these."""

    call: Callable[..., float]
    least: int
    most: int
    keeps_unit: bool = True


def _root(x: float) -> float:
    return math.sqrt(x) if x >= 0.0 else math.nan


def _least(*numbers: float) -> float:
    return math.nan if any(map(math.isnan, numbers)) else min(numbers)


def _most(*numbers: float) -> float:
    return math.nan if any(map(math.isnan, numbers)) else max(numbers)


def _angle(x: float) -> float:
    """An angle (rad) between -π and π."""
    return wrap(x) if math.isfinite(x) else math.nan


def distance(a: Any, b: Any) -> float:
    """The distance over ground (m) of two positions, exact to 1e-5 within 10 km of their references."""
    try:
        offset, rows = _frames(a.lat, a.lon, getattr(a, "height", 0.0), b.lat, b.lon, getattr(b, "height", 0.0))
    except ValueError:  # an infinite latitude
        return math.nan
    (dx, dy, dz), x, y = offset, 0.0, 0.0
    if hasattr(b, "x"):
        bx, by, bz = b.x, b.y, b.z
        (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rows
        dx += xx * bx + xy * by + xz * bz
        dy += yx * bx + yy * by + yz * bz
        dz += zx * bx + zy * by + zz * bz
    if hasattr(a, "x"):
        x, y = a.x, a.y
        dx, dy, dz = dx - x, dy - y, dz - a.z
    # The vertical at the first position leans by its distance from the reference over the radius of the Earth.
    return math.hypot(dx + dz * x / SEMI_MAJOR_AXIS, dy + dz * y / SEMI_MAJOR_AXIS)


@lru_cache(maxsize=64)
def _frames(
    lat: float, lon: float, height: float, to_lat: float, to_lon: float, to_height: float
) -> tuple[tuple[float, float, float], tuple[tuple[float, float, float], ...]]:
    """Offset of the second in the first of two references, and its axes, from their frames north, east, down."""
    offset = displacement(lat, lon, height, to_lat, to_lon, to_height)
    turn = to_lon - lon
    s, c, ts, tc = math.sin(lat), math.cos(lat), math.sin(to_lat), math.cos(to_lat)
    st, ct = math.sin(turn), math.cos(turn)
    return offset, (
        (s * ts * ct + c * tc, s * st, s * tc * ct - c * ts),
        (-ts * st, ct, -tc * st),
        (c * ts * ct - s * tc, c * st, c * tc * ct + s * ts),
    )


def contains_position(kind: type[imc.Message], *, deep: bool = False) -> bool:
    """Whether messages of this kind have a position on Earth, and if `deep`, also the place of a vehicle from there."""
    needed = {"lat", "lon", "x", "y", "z"} if deep else {"lat", "lon"}
    return needed <= {info.name for info in imc.fields(kind)}


FUNCTIONS: Mapping[str, ExpressionFunction] = MappingProxyType(
    {
        "abs": ExpressionFunction(math.fabs, 1, 1),
        "angle": ExpressionFunction(_angle, 1, 1),
        "hypot": ExpressionFunction(math.hypot, 1, 9),
        "max": ExpressionFunction(_most, 1, 9),
        "min": ExpressionFunction(_least, 1, 9),
        "sqrt": ExpressionFunction(_root, 1, 1, keeps_unit=False),
    }
)
