"""DesiredPath as every guidance reads it, and the report on its progress."""

import math

import imc
from support.wgs84 import is_on_earth

Flags = imc.DesiredPath.Flags
Reached = imc.PathControlState.Flags
LONGEST = 25000.0  # m
KEPT_FLAGS = Flags.NO_Z | Flags["_3DTRACK"] | Flags.CCLOCKW
UNKNOWN_ETA = 0xFFFF


def is_valid_path(path: imc.DesiredPath) -> bool:
    """Whether the numbers of a path are finite and its end is a position on Earth."""
    numbers = path.end_lat, path.end_lon, path.end_z, path.speed, path.lradius, path.start_lat, path.start_lon
    return all(map(math.isfinite, numbers)) and is_on_earth(path.end_lat, path.end_lon)


def length_violation(length: float) -> str:
    """The objection to a path of a length (m), "" if it is short enough."""
    return f"the desired path is longer than {LONGEST / 1000:g} km" if length > LONGEST else ""


def loiters_here(path: imc.DesiredPath) -> bool:
    """Whether the path is a circle around the position of the vehicle."""
    return bool(path.flags & Flags.LOITER_CURR) and path.lradius > 0.0


def circle_side(path: imc.DesiredPath) -> int:
    """1 for a circle that is clockwise from above, -1 for one that is not."""
    return -1 if path.flags & Flags.CCLOCKW else 1


def eta_field(seconds: float) -> int:
    """A time to the end of a path as PathControlState has it."""
    return round(max(0.0, min(UNKNOWN_ETA, seconds)))


def path_control_state(path: imc.DesiredPath, *, near: bool, loitering: bool) -> imc.PathControlState:
    """The report on a path, without the progress on it."""
    flags = path.flags & KEPT_FLAGS | (Reached.NEAR if near else 0) | (Reached.LOITERING if loitering else 0)
    return imc.PathControlState(
        path_ref=path.path_ref,
        start_lat=path.start_lat,
        start_lon=path.start_lon,
        start_z=path.start_z,
        start_z_units=path.start_z_units,
        end_lat=path.end_lat,
        end_lon=path.end_lon,
        end_z=path.end_z,
        end_z_units=path.end_z_units,
        lradius=path.lradius,
        flags=flags,
    )
