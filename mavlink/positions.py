"""Home and positions of a vehicle as MAVLink has them: altitudes above mean sea level and above home."""

import math
from typing import NamedTuple

import imc
from imc import coordinates
from support.rotations import wrap

FARTHEST = 1e7  # m from the reference point
HIGHEST = 2e6  # m, what an int32 holds in mm


class GlobalPosition(NamedTuple):
    """Position of the vehicle: latitude and longitude in rad, altitudes in m above mean sea level and above home."""

    lat: float
    lon: float
    altitude: float
    relative: float


class Home(NamedTuple):
    """The origin of altitudes and local positions: rad, and m above the ellipsoid and above mean sea level."""

    lat: float
    lon: float
    height: float
    altitude: float


def home_from_state(state: imc.EstimatedState, *, afloat: bool, undulation: float = 0.0) -> Home | None:
    """Home at the reference point of a state; for a vessel it is at the surface, with altitude 0.

    `undulation` is the height of the geoid above the ellipsoid, in m.
    """
    if not (_on_earth(state.lat, state.lon) and abs(state.height) <= HIGHEST):
        return None
    return Home(state.lat, state.lon, state.height, 0.0 if afloat else state.height - undulation)


def home_at(lat: float, lon: float, altitude: float, *, afloat: bool, undulation: float = 0.0) -> Home | None:
    """Home at a place (rad, m above mean sea level) that a ground station has chosen; None if it is impossible."""
    altitude = 0.0 if afloat else altitude
    if not (_on_earth(lat, lon) and abs(altitude) <= HIGHEST):
        return None
    return Home(lat, lon, altitude + undulation, altitude)


def position_of(
    state: imc.EstimatedState, home: Home, *, afloat: bool, undulation: float = 0.0
) -> GlobalPosition | None:
    """Position of the vehicle: the reference point of `state`, moved by its offsets on the WGS-84 ellipsoid.

    A vessel is `depth` below home, or `z` below the reference point if the depth is invalid (-1).
    """
    if not (_on_earth(state.lat, state.lon) and max(abs(state.x), abs(state.y)) <= FARTHEST):
        return None
    if afloat and state.depth > HIGHEST:
        return None
    if not (abs(state.z) <= HIGHEST and abs(state.height) <= HIGHEST):
        return None
    try:
        lat, lon, height = coordinates.absolute_position(state)
    except (ArithmeticError, ValueError):
        return None
    if not (_on_earth(lat, lon) and abs(height) <= HIGHEST):
        return None
    if afloat:
        altitude = -max(0.0, state.depth) if has_valid_depth(state) else -state.z
        return GlobalPosition(lat, lon, altitude, altitude)
    altitude = height - undulation
    return GlobalPosition(lat, lon, altitude, altitude - home.altitude)


def has_valid_depth(state: imc.EstimatedState) -> bool:
    """Whether the depth is known: -1 means unknown, values slightly below 0 are waves."""
    return -1.0 < state.depth <= HIGHEST


def degrees_e7(angle: float) -> int:
    """An angle in rad as 1e-7 degrees, between -180 and 180 degrees."""
    return round(math.degrees(wrap(angle)) * 1e7)


def _on_earth(lat: float, lon: float) -> bool:
    return abs(lat) <= math.pi / 2 and math.isfinite(lon)
