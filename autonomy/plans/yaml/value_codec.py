"""Reads and writes the values of plan files: with units, in degrees, by name, and without loss."""

import math
import re
from collections.abc import Mapping
from typing import Any, cast

import numpy as np

import imc
from support.float32 import shortest_float32
from support.terminal_text import suggestion
from support.units import UNITS, symbols_of, unit_suggestion
from support.wgs84 import is_on_earth

Z_UNITS = {"depth": imc.ZUnits.DEPTH, "altitude": imc.ZUnits.ALTITUDE, "height": imc.ZUnits.HEIGHT}
SPEED_UNITS = {"m/s": imc.SpeedUnits.METERS_PS, "rpm": imc.SpeedUnits.RPM, "%": imc.SpeedUnits.PERCENTAGE}
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
_SYMBOLS = "|".join(map(re.escape, sorted(UNITS, key=len, reverse=True)))
_QUANTITY = re.compile(rf"({_NUMBER.pattern})\s*({_SYMBOLS})?")
_ANGLES = symbols_of("rad")
_CONVERTED = ("rad", "s", "m", "m/s", "rad/s", "m/s/s", "%")  # units of fields that may be written in another one
LARGEST = 2.0**64  # of an integer field


def parse_quantity(value: object, unit: str = "") -> float:
    """A number, or a text such as "15°", in SI units; a plain number is in SI units.

    Raises ValueError if it is not a number, or has a unit that does not fit `unit`.
    """
    number, found = split_quantity(value)
    if found and unit in _CONVERTED and UNITS[found].si != unit:
        raise ValueError(f"{value!r} should be in {' or '.join(symbols_of(unit))}")
    return UNITS[found].to_si(number) if found else number


def parse_in_unit(value: object, unit: str) -> float:
    """A number in `unit`: a plain one, or a text with this unit, or with another of its dimension.

    Raises ValueError if it is not a number, or has a unit that does not fit.
    """
    text = value.strip() if isinstance(value, str) else ""
    own = _NUMBER.fullmatch(text.removesuffix(unit).strip()) if unit and not text[-1:].isdecimal() else None
    if own is not None:
        value = own.group()
    dimension = UNITS[unit].si if unit in UNITS else ""
    words = f"in {' or '.join(symbols_of(dimension) or (unit,))}" if unit else "a number without a unit"
    if _NUMBER.match(text) and not (own or _QUANTITY.fullmatch(text)):
        raise ValueError(f"{value!r} should be {words}")
    number, found = split_quantity(value)
    if found and UNITS[found].si != dimension:
        raise ValueError(f"{value!r} should be {words}")
    return number * (UNITS[found].factor / UNITS[unit].factor) if found else number


def split_quantity(value: object) -> tuple[float, str]:
    """Number and unit of "1.2 m/s". Raises ValueError if it is not a number."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        if not math.isfinite(value):
            raise ValueError(f"{value} is not a number")
        return float(value), ""
    match = _QUANTITY.fullmatch(value.strip()) if isinstance(value, str) else None
    if match is None:
        number = _NUMBER.match(value.strip()) if isinstance(value, str) else None
        hint = unit_suggestion(number.string[number.end() :]) if number else ""
        raise ValueError(f"{value!r} is not a number with a unit ({hint or ', '.join(UNITS)})")
    number = float(match.group(1))
    if not math.isfinite(number):
        raise ValueError(f"{value!r} is too large a number")
    return number, match.group(2) or ""


def parse_speed(value: object) -> dict[str, Any]:
    """The fields of a speed such as "1.2 m/s", "1200 rpm" or "60 %"; a plain number is in m/s."""
    number, unit = split_quantity(value)
    if unit and UNITS[unit].si not in SPEED_UNITS:
        known = [symbol for si in SPEED_UNITS for symbol in symbols_of(si)]
        raise ValueError(f"{value!r} should be in {', '.join(known)}")
    if number <= 0.0:
        raise ValueError("speed must be above 0")
    converted = UNITS[unit].to_si(number) if unit else number
    return {"speed": converted, "speed_units": int(SPEED_UNITS[UNITS[unit].si if unit else "m/s"])}


def parse_position(value: object) -> tuple[float, float]:
    """Latitude and longitude (rad) of a text such as "41.185°, -8.7062°", or of two such values."""
    parts: list[Any] = value.split(",") if isinstance(value, str) else []
    parts = cast(list[Any], value) if isinstance(value, list) else parts
    if len(parts) != 2:
        raise ValueError(f"{value!r} is not a latitude and a longitude")
    if not all(split_quantity(part)[1] in _ANGLES for part in parts):
        raise ValueError(f"{value!r}: write the unit, as in 41.185°, -8.7062°")
    lat, lon = parse_quantity(parts[0], "rad"), parse_quantity(parts[1], "rad")
    if not is_on_earth(lat, lon):
        raise ValueError(f"{value!r} is not a place on Earth: latitudes end at 90°, longitudes at 180°")
    return lat, lon


def format_degrees(angle: float) -> str:
    """An angle (rad) as text in degrees that `parse_quantity` reads back exactly; in rad if no number does."""
    text = math.degrees(angle)
    for digits in range(1, 18):
        short = f"{text:.{digits}g}"
        if math.radians(float(short)) == angle:
            return f"{float(short)!r}°".replace(".0°", "°")
    for candidate in (text, math.nextafter(text, math.inf), math.nextafter(text, -math.inf)):
        if math.radians(candidate) == angle:
            return f"{candidate!r}°"
    return f"{angle!r} rad"


def shortest_number(value: float, kind: str) -> int | float:
    """The shortest number that a field of type `kind` stores as `value`."""
    if kind == "fp32_t" and math.isfinite(value):
        short = shortest_float32(value)
        value = short if np.float32(short) == np.float32(value) else value
    return int(value) if float(value).is_integer() and abs(value) < 1e15 else value


def read_field(info: imc.FieldInfo, value: object) -> object:
    """The value of a message field, from its form in a plan file."""
    if isinstance(value, str) and info.type.endswith("_t") and _NUMBER.fullmatch(value):  # 1e-3, a text in YAML 1.1
        power, _ = split_quantity(value)
        return int(power) if power.is_integer() and not info.type.startswith("fp") else power
    if isinstance(value, str) and info.unit in _CONVERTED:
        si = parse_quantity(value, info.unit)
        return si if info.type.startswith("fp") or abs(si) > LARGEST else round(si)
    if isinstance(value, str) and info.enum is not None and value not in info.enum.__members__:
        hint = suggestion(value, info.enum.__members__)
        raise ValueError(f"{info.name}: {value!r} is not a valid name" + (f" ({hint})" if hint else ""))
    if isinstance(value, list) and info.enum is not None:
        names = cast(list[Any], value)
        members: Mapping[str, Any] = info.enum.__members__
        wrong = [name for name in names if name not in members]
        if wrong:
            raise ValueError(f"{wrong[0]!r} is not one of {', '.join(members)}")
        return sum(int(members[name]) for name in names)  # integers
    return cast(object, value)


def write_field(info: imc.FieldInfo, value: Any) -> Any:
    """The form of a field in a plan file."""
    if info.enum is not None and info.unit == "Bitfield" and isinstance(value, int):
        names = [name for name, member in info.enum.__members__.items() if int(member) & value]
        total = sum(int(info.enum.__members__[name]) for name in names)  # integers
        return names if total == value else int(value)
    if info.enum is not None and value in set(map(int, info.enum)):
        return info.enum(value).name
    if isinstance(value, float) and info.unit == "rad" and math.isfinite(value):
        return format_degrees(value) if info.type == "fp64_t" else shortest_number(value, info.type)
    return (
        shortest_number(value, info.type) if isinstance(value, float) and math.isfinite(value) else cast(object, value)
    )
