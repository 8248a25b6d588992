"""The functions of expressions."""

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import imc
from imc.coordinates import absolute, offset


class Function(NamedTuple):
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
    return math.remainder(x, math.tau) if math.isfinite(x) else math.nan


def distance(a: Any, b: Any) -> float:
    """The distance over ground (m) of two positions."""
    if hasattr(a, "x") and hasattr(b, "x") and (a.lat, a.lon) == (b.lat, b.lon):
        return math.hypot(a.x - b.x, a.y - b.y)
    try:
        return math.hypot(*offset(*_place(a), *_place(b)))
    except (ValueError, ZeroDivisionError):  # an infinite latitude
        return math.nan


def _place(message: Any) -> tuple[float, float]:
    return absolute(message)[:2] if hasattr(message, "x") else (message.lat, message.lon)


def has_place(kind: type[imc.Message]) -> bool:
    """Whether messages of this kind tell a position on Earth."""
    return {"lat", "lon"} <= {info.name for info in imc.fields(kind)}


FUNCTIONS: Mapping[str, Function] = MappingProxyType(
    {
        "abs": Function(math.fabs, 1, 1),
        "angle": Function(_angle, 1, 1),
        "hypot": Function(math.hypot, 1, 9),
        "max": Function(_most, 1, 9),
        "min": Function(_least, 1, 9),
        "sqrt": Function(_root, 1, 1, keeps_unit=False),
    }
)
OF_PLACES: Mapping[str, Callable[[Any, Any], float]] = MappingProxyType({"distance": distance})
