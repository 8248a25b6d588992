"""Reads numbers in files that people write and in JSON, and limits numbers."""

import math
import re
from contextlib import suppress

from support.diagnostics import LocatedError

MOST_DIGITS = 18
NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?(?:inf|nan)\b", re.IGNORECASE)


def parse_number(text: str) -> int | float:
    """A decimal or 0x integer, or a finite float. Raises ValueError, also for an integer beyond any float."""
    try:
        number = int(text, 16 if text.lower().startswith(("0x", "-0x")) else 10)
    except ValueError:
        pass
    else:
        return require_float_range(number)
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if value - value != 0.0:
        raise ValueError(f"{text!r} is not a number")
    return value


def require_float_range(number: int) -> int:
    """The integer itself. Raises ValueError for one that no float can hold, as arithmetic needs."""
    try:
        float(number)
    except OverflowError:
        raise ValueError("an integer of more than 308 digits is too large a number") from None
    return number


def is_number(text: str) -> bool:
    """Whether a text is a number as Python reads it, also NaN or infinity."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def leading_number(text: str) -> float:
    """The number at the start of a text, as DUNE reads it: 50.0 of "50.0 m". Raises ValueError if there is none."""
    match = NUMBER.match(text.strip())
    if match is None:
        raise ValueError(f"{text!r} is not a number")
    return float(match.group())


def leading_numbers(text: str) -> list[float]:
    """The numbers of a list with commas, each as in `leading_number`; none of a blank text. Raises ValueError."""
    return [leading_number(word) for word in text.split(",")] if text.strip() else []


def natural_number(text: str) -> int | None:
    """The integer that a text of at most 18 decimal digits is; None for other texts."""
    return int(text) if text.isascii() and text.isdecimal() and len(text) <= MOST_DIGITS else None


def finite_number(value: object) -> float | None:
    """A number of JSON as a finite float; None for other values, also for an integer beyond any float."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    with suppress(OverflowError):
        if math.isfinite(number := float(value)):
            return number
    return None


def clamp_magnitude(value: float, limit: float) -> float:
    """The value, limited to between -`limit` and `limit`."""
    return -limit if value < -limit else limit if value > limit else value


def number_at(word: str, where: str, error: type[LocatedError]) -> float:
    """The number that a word of a file is. Raises `error` that names its place."""
    try:
        return float(parse_number(word.strip()))
    except ValueError:
        raise error(f"{word.strip()!r:.40} is not a number", where) from None
