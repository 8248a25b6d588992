"""Latitude and longitude as people read them: in degrees, to a centimeter."""

import math


def format_coordinate(angle: float) -> str:
    """A latitude or longitude (rad) in degrees: 41.1850000°; 1e-7° are 1.1 cm."""
    return f"{math.degrees(angle):.7f}°" if math.isfinite(angle) else str(angle)


def format_position(lat: float, lon: float) -> str:
    """Latitude and longitude (rad) in degrees: 41.1850000° -8.7062000°."""
    return f"{format_coordinate(lat)} {format_coordinate(lon)}"
