"""Makes plans from templates: one maneuver, or a flight."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import imc
from autonomy.plans.estimate import LatLon
from autonomy.plans.sequence import sequential_plan
from support.wgs84 import is_on_earth

DEPTH = imc.ZUnits.DEPTH
RPM = imc.SpeedUnits.RPM
TEMPLATES = ("go", "sk", "come_near", "loiter", "dive", "surface", "dislodge", "flight")
CLIMB, CRUISE, ALTITUDE = 2.0, 5.0, 15.0  # m/s, m/s, m: defaults of a flight


class TemplateError(ValueError):
    """A template is unknown, or a parameter is missing or wrong."""


@dataclass(frozen=True)
class TemplateDefaults:
    """Defaults for the parameters of templates: depths and radius in m, time in s, speed in rpm."""

    travel_depth: float
    dive_depth: float
    dive_seconds: int
    radius: float
    rpm: float


def plan_from_template(
    name: str,
    params: Mapping[str, str],
    vehicle_position: LatLon | None,
    requester_position: LatLon | None,
    defaults: TemplateDefaults,
) -> imc.PlanSpecification:
    """The plan of a template: go, sk, come_near, loiter (at the surface), dive, surface, dislodge; flight.

    A flight takes off, circles and lands. Positions in `params` are in degrees. Raises TemplateError.
    """
    speed: dict[str, Any] = {"speed": _number(params, "rpm", defaults.rpm), "speed_units": RPM}
    depth: dict[str, Any] = {"z": _number(params, "depth", defaults.travel_depth), "z_units": DEPTH}
    radius = _number(params, "radius", defaults.radius)
    seconds = round(min(65535.0, max(0.0, _number(params, "duration", defaults.dive_seconds))))
    if name == "go":
        lat, lon = _place(params, vehicle_position)
        maneuver: imc.Message = imc.Goto(lat=lat, lon=lon, **depth, **speed)
    elif name in ("sk", "come_near"):
        lat, lon = _place(params, requester_position if name == "come_near" else vehicle_position)
        surface: dict[str, Any] = {"z": _number(params, "depth", 0.0), "z_units": DEPTH}
        maneuver = imc.StationKeeping(lat=lat, lon=lon, radius=radius, **surface, **speed)
    elif name in ("loiter", "dive"):
        lat, lon = _place(params, vehicle_position)
        usually = defaults.dive_depth if name == "dive" else 0.0
        deep: dict[str, Any] = {"z": _number(params, "depth", usually), "z_units": DEPTH}
        maneuver = imc.Loiter(lat=lat, lon=lon, radius=radius, duration=seconds, **deep, **speed)
    elif name == "surface":
        lat, lon = _place({}, vehicle_position)
        flags = imc.Elevator.Flags.CURR_POS
        maneuver = imc.Elevator(lat=lat, lon=lon, end_z=0.0, end_z_units=DEPTH, radius=radius, flags=flags, **speed)
    elif name == "dislodge":
        maneuver = imc.Dislodge(rpm=_number(params, "rpm", defaults.rpm))
    elif name == "flight":
        lat, lon = _place(params, vehicle_position)
        up: dict[str, Any] = {"z": _number(params, "altitude", ALTITUDE), "z_units": imc.ZUnits.ALTITUDE}
        up |= {"lat": lat, "lon": lon}
        cruise = _number(params, "speed", CRUISE)
        circles = imc.Loiter(radius=radius, duration=seconds, speed=cruise, **up)
        flight = {"takeoff": imc.Takeoff(speed=CLIMB, **up), "circles": circles, "land": imc.Land(speed=cruise, **up)}
        return sequential_plan(name, flight)
    else:
        raise TemplateError("Given plan id was not understood.")
    return sequential_plan(name, {name: maneuver})


def _place(params: Mapping[str, str], otherwise: LatLon | None) -> LatLon:
    if "lat" in params or "lon" in params:
        lat, lon = (math.radians(_number(params, name, math.nan)) for name in ("lat", "lon"))
        if not is_on_earth(lat, lon):
            raise TemplateError("lat and lon are not a position in degrees")
        return lat, lon
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
