"""Units that may follow a number, and what they are in SI."""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from support.terminal_text import nearest_word


class Unit(NamedTuple):
    """The SI unit of the dimension, and how many of it one is; `is_degree` if π/180 has to be rounded once only."""

    si: str
    factor: float = 1.0
    is_degree: bool = False

    def to_si(self, number: float) -> float:
        """A number of this unit in SI."""
        return math.radians(number) if self.is_degree else number * self.factor


_DEGREE = math.radians(1.0)
UNITS: Mapping[str, Unit] = MappingProxyType(
    {
        "°": Unit("rad", _DEGREE, is_degree=True),
        "deg": Unit("rad", _DEGREE, is_degree=True),
        "rad": Unit("rad"),
        "s": Unit("s"),
        "ms": Unit("s", 1e-3),
        "min": Unit("s", 60.0),
        "h": Unit("s", 3600.0),
        "m": Unit("m"),
        "km": Unit("m", 1000.0),
        "cm": Unit("m", 0.01),
        "mm": Unit("m", 0.001),
        "nmi": Unit("m", 1852.0),
        "m/s": Unit("m/s"),
        "kn": Unit("m/s", 1852.0 / 3600.0),
        "km/h": Unit("m/s", 1.0 / 3.6),
        "rpm": Unit("rpm"),
        "%": Unit("%"),
        "°/s": Unit("rad/s", _DEGREE, is_degree=True),
        "deg/s": Unit("rad/s", _DEGREE, is_degree=True),
        "rad/s": Unit("rad/s"),
        "m/s²": Unit("m/s/s"),
        "m/s/s": Unit("m/s/s"),
        "Hz": Unit("Hz"),
        "V": Unit("V"),
        "A": Unit("A"),
        "°C": Unit("°C"),
        "hPa": Unit("hPa"),
        "B/s": Unit("B/s"),
        "kB/s": Unit("B/s", 1000.0),
        "bit/s": Unit("B/s", 0.125),
        "kbit/s": Unit("B/s", 125.0),
    }
)
"""Symbols of units. The nautical mile and the knot are those of the SI brochure, table 8."""


_NAMES = {
    "knot": "kn",
    "kt": "kn",
    "meter": "m",
    "metre": "m",
    "kilometer": "km",
    "second": "s",
    "sec": "s",
    "minute": "min",
    "hour": "h",
    "degree": "°",
    "radian": "rad",
    "percent": "%",
    "mps": "m/s",
    "kmh": "km/h",
    "kph": "km/h",
    "hertz": "Hz",
    "volt": "V",
    "ampere": "A",
    "amp": "A",
    "celsius": "°C",
}


def unit_suggestion(word: str) -> str:
    """A hint with the symbol of a unit that is written out, such as knots, or misspelled; empty if none is close."""
    name = word.strip().casefold()
    symbol = _NAMES.get(name) or _NAMES.get(name.removesuffix("s")) or nearest_word(name, UNITS)
    return f"did you mean {symbol!r}?" if symbol else ""


def symbols_of(si: str) -> tuple[str, ...]:
    """The symbols of all units of a dimension, by its SI unit; empty if it is not known."""
    return tuple(symbol for symbol, unit in UNITS.items() if unit.si == si)
