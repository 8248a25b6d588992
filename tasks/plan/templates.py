"""Makes plans from templates: one maneuver, or a flight."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import imc

Position = tuple[float, float]  # latitude, longitude (rad)
DEPTH = imc.ZUnits.DEPTH
RPM = imc.SpeedUnits.RPM
TEMPLATES = ("go", "sk", "come_near", "loiter", "dive", "surface", "dislodge", "flight")
CLIMB, CRUISE, ALTITUDE = 2.0, 5.0, 15.0  # m/s, m/s, m: defaults of a flight


class TemplateError(ValueError):
    """A template is unknown, or a parameter is missing or wrong."""


@dataclass(frozen=True)
class Usual:
    """Defaults for the parameters of templates: depths and radius in m, time in s, speed in rpm."""

    travel_depth: float
    dive_depth: float
    dive_seconds: int
    radius: float
    rpm: float


def generate(
    name: str, params: Mapping[str, str], here: Position | None, asker: Position | None, usual: Usual
) -> imc.PlanSpecification:
    """The plan of a template: go, sk, come_near, loiter (at the surface), dive, surface, dislodge; flight.

    A flight takes off, circles and lands. `here` is the vehicle's position, `asker` that of the requester. Positions in
    `params` are in degrees. Raises TemplateError.
    """
    speed: dict[str, Any] = {"speed": _number(params, "rpm", usual.rpm), "speed_units": RPM}
    depth: dict[str, Any] = {"z": _number(params, "depth", usual.travel_depth), "z_units": DEPTH}
    radius = _number(params, "radius", usual.radius)
    seconds = round(min(65535.0, max(0.0, _number(params, "duration", usual.dive_seconds))))
    if name == "go":
        lat, lon = _place(params, here)
        maneuver: imc.Message = imc.Goto(lat=lat, lon=lon, **depth, **speed)
    elif name in ("sk", "come_near"):
        lat, lon = _place(params, asker if name == "come_near" else here)
        surface: dict[str, Any] = {"z": _number(params, "depth", 0.0), "z_units": DEPTH}
        maneuver = imc.StationKeeping(lat=lat, lon=lon, radius=radius, **surface, **speed)
    elif name in ("loiter", "dive"):
        lat, lon = _place(params, here)
        usually = usual.dive_depth if name == "dive" else 0.0
        deep: dict[str, Any] = {"z": _number(params, "depth", usually), "z_units": DEPTH}
        maneuver = imc.Loiter(lat=lat, lon=lon, radius=radius, duration=seconds, **deep, **speed)
    elif name == "surface":
        lat, lon = _place({}, here)
        flags = imc.Elevator.Flags.CURR_POS
        maneuver = imc.Elevator(lat=lat, lon=lon, end_z=0.0, end_z_units=DEPTH, radius=radius, flags=flags, **speed)
    elif name == "dislodge":
        maneuver = imc.Dislodge(rpm=_number(params, "rpm", usual.rpm))
    elif name == "flight":
        lat, lon = _place(params, here)
        up: dict[str, Any] = {"z": _number(params, "altitude", ALTITUDE), "z_units": imc.ZUnits.ALTITUDE}
        up |= {"lat": lat, "lon": lon}
        cruise = _number(params, "speed", CRUISE)
        return _chain(
            name,
            takeoff=imc.Takeoff(speed=CLIMB, **up),
            circles=imc.Loiter(radius=radius, duration=seconds, speed=cruise, **up),
            land=imc.Land(speed=cruise, **up),
        )
    else:
        raise TemplateError("Given plan id was not understood.")
    return _chain(name, **{name: maneuver})


def _chain(plan: str, **maneuvers: imc.Message) -> imc.PlanSpecification:
    """A plan of maneuvers in sequence."""
    names = list(maneuvers)
    return imc.PlanSpecification(
        plan_id=plan,
        start_man_id=names[0],
        maneuvers=tuple(imc.PlanManeuver(maneuver_id=name, data=data) for name, data in maneuvers.items()),
        transitions=tuple(
            imc.PlanTransition(source_man=source, dest_man=destination, conditions="ManeuverIsDone")
            for source, destination in pairwise(names)
        ),
    )


def _place(params: Mapping[str, str], otherwise: Position | None) -> Position:
    if "lat" in params or "lon" in params:
        lat, lon = _number(params, "lat", math.nan), _number(params, "lon", math.nan)
        if not (abs(lat) <= 90.0 and abs(lon) <= 180.0):
            raise TemplateError("lat and lon are not a position in degrees")
        return math.radians(lat), math.radians(lon)
    if otherwise is None:
        raise TemplateError("position is unknown")
    return otherwise


def _number(params: Mapping[str, str], name: str, default: float) -> float:
    try:
        value = float(params.get(name, default))
    except ValueError:
        value = math.inf
    if name in params and not math.isfinite(value):
        raise TemplateError(f"{name} is not a number")
    return value
