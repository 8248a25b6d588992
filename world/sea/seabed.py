"""The bottom of the simulated sea, as the profile describes it."""

import math
from collections.abc import Callable

from world.sea.bathymetry import Bathymetry, BathymetryError, read_bathymetry

SECTION = "Simulators.Environment"
SOUNDING_RADIUS = 10.0  # m
OUT_OF_BOUNDS = 120.0  # m
TIDE = 0.0  # m


def read_seabed(value: Callable[[str, str], str]) -> Bathymetry | None:
    """The bottom; None if the profile has neither [Bathymetry] nor an Environment.

    `value(section, option)` returns the texts of the profile. Raises BathymetryError.
    """
    if not value("Bathymetry", "Data") and not value(SECTION, "Enabled"):
        return None
    radius = _number(value, "Sounding Radius", SOUNDING_RADIUS)
    if radius <= 0.0:
        raise BathymetryError(f"[{SECTION}] Sounding Radius = {radius:g} must be more than 0")
    elsewhere = _number(value, "Out Of Bounds Depth", OUT_OF_BOUNDS)
    return read_bathymetry(value, radius, elsewhere, _number(value, "Tide Level", TIDE))


def seabed_in_use(value: Callable[[str, str], str]) -> Bathymetry | None:
    """The bottom, if the sonars of the modes that run measure it; else None. Raises BathymetryError."""
    modes = {"Always", *_words(value("General", "Selected"))}
    return None if modes.isdisjoint(_words(value(SECTION, "Enabled"))) else read_seabed(value)


def _words(text: str) -> list[str]:
    return [word.strip() for word in text.split(",")]


def _number(value: Callable[[str, str], str], option: str, default: float) -> float:
    text = value(SECTION, option)
    try:
        number = float(text) if text else default
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise BathymetryError(f"[{SECTION}] {option} = {text} is not a number")
    return number
