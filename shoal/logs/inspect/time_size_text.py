"""Times, spans and sizes as people read them."""

import math
from datetime import UTC, datetime


def format_time(time: float) -> str:
    """A time (s since 1970 UTC) as "2026-01-01 00:00:00.000 UTC"; the number if it is not a date."""
    try:
        return f"{datetime.fromtimestamp(round(time, 3), UTC):%Y-%m-%d %H:%M:%S.%f}"[:-3] + " UTC"
    except (ValueError, OverflowError, OSError):
        return f"{time:g} s"


def format_duration(seconds: float) -> str:
    """ "45.0 s", "10 min 00 s", "3 h 12 min", "2 d 5 h"; the sign in front."""
    if not math.isfinite(seconds):
        return "unknown"
    sign, seconds = ("-" if seconds < 0 else ""), abs(seconds)
    if seconds < 59.95:
        return f"{sign}{seconds:.1f} s"
    whole = round(seconds)
    if whole < 3600:
        return f"{sign}{whole // 60} min {whole % 60:02} s"
    if whole < 86400:
        return f"{sign}{whole // 3600} h {whole % 3600 // 60:02} min"
    return f"{sign}{whole // 86400} d {whole % 86400 // 3600} h"


def format_size(count: int) -> str:
    """ "512 bytes", "8.3 MB", "1.2 GB" (decimal)."""
    if count < 1000:
        return "1 byte" if count == 1 else f"{count} bytes"
    value, units = count / 1000, ["kB", "MB", "GB", "TB"]
    while value >= 999.5 and len(units) > 1:
        value /= 1000
        units.pop(0)
    return f"{value:.3g} {units[0]}"


def format_rate(hertz: float) -> str:
    """ "20 Hz", "0.88 Hz"; empty if unknown."""
    return "" if math.isnan(hertz) else f"{hertz:.3g} Hz" if hertz < 100 else f"{hertz:.0f} Hz"


def format_noun_count(count: int, noun: str, plural: str = "") -> str:
    """ "1 message", "12 345 messages"."""
    return f"{count:,} {noun if count == 1 else plural or noun + 's'}".replace(",", " ")
