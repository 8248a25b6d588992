"""Bounds of a plan: the allowed area and altitude, and a takeoff before any flight."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import imc
from autonomy.plans.estimate import waypoints
from autonomy.plans.graph import ROUNDING, PlanGraph
from support.wgs84 import displacement

Limit = imc.OpLimitsMask
Units = imc.ZUnits
MEASURED = 0.5  # m by which the height of the ground may be off
ANYWHERE = imc.Takeoff | imc.IdleManeuver | imc.Land  # allowed on the ground as well


@dataclass(frozen=True)
class PlanBounds:
    """Current limits; `ground` is the height (m above the ellipsoid) of the ground, None if unknown."""

    limits: imc.OperationalLimits | None = None
    highest: float = math.inf
    ground: float | None = None
    airborne: bool = False

    @property
    def altitude(self) -> float:
        """The highest altitude (m above ground)."""
        limits = self.limits
        set_ = limits is not None and limits.mask & Limit.MAX_ALT
        return min(self.highest, limits.max_altitude) if limits is not None and set_ else self.highest


def area_violations(graph: PlanGraph, bounds: PlanBounds) -> Iterator[str]:
    """Objections to maneuvers that leave the area of the limits, and to limits that are not numbers."""
    area = bounds.limits
    if area is not None and not all(map(math.isfinite, _numbers(area))):
        yield "the operational limits have a value that is not a number"
        return
    if area is None or not area.mask & Limit.AREA:
        return
    c, s = math.cos(area.orientation), math.sin(area.orientation)
    for name, node in graph.nodes.items():
        margin = getattr(node.maneuver, "radius", 0.0) if isinstance(node.maneuver, imc.Loiter) else 0.0
        for lat, lon in waypoints(node.maneuver):
            north, east, _ = displacement(area.lat, area.lon, 0.0, lat, lon, 0.0)
            along, across = abs(c * north + s * east), abs(c * east - s * north)
            if along + margin > 0.5 * area.length or across + margin > 0.5 * area.width:
                yield f"{name}: is outside the area of the operational limits"
                break


def _numbers(limits: imc.OperationalLimits) -> Iterator[float]:
    """The values of the limits that bound a plan."""
    if limits.mask & Limit.MAX_ALT:
        yield limits.max_altitude
    if limits.mask & Limit.AREA:
        yield from (limits.lat, limits.lon, limits.orientation, limits.width, limits.length)


def flight_violations(graph: PlanGraph, bounds: PlanBounds) -> Iterator[str]:
    """Objections to the plan of an aerial vehicle: depths, heights, speeds, and flying before a takeoff."""
    for name, node in graph.nodes.items():
        yield from (f"{name}: {reason}" for reason in _vertical(node.maneuver, bounds))
    seen: set[tuple[str, bool]] = set()
    waiting = [(graph.start, bounds.airborne)]
    while waiting:
        step = name, airborne = waiting.pop()
        if step in seen or name not in graph.nodes:
            continue
        seen.add(step)
        node = graph.nodes[name]
        if not airborne and not isinstance(node.maneuver, ANYWHERE):
            yield f"{name}: the vehicle is on the ground, a Takeoff must come first"
            return
        after = airborne if isinstance(node.maneuver, imc.IdleManeuver) else not isinstance(node.maneuver, imc.Land)
        waiting += [(destination, after) for _, destination in node.transitions]


def _vertical(maneuver: imc.Message, bounds: PlanBounds) -> Iterator[str]:
    units, z = getattr(maneuver, "z_units", Units.NONE), getattr(maneuver, "z", 0.0)
    points = [point.z for point in getattr(maneuver, "points", ()) if isinstance(point, imc.PathPoint)]
    if getattr(maneuver, "speed_units", 0) != imc.SpeedUnits.METERS_PS:
        yield "the speed of an aerial vehicle must be in m/s"
    if units == Units.DEPTH:
        yield "an aerial vehicle cannot go to a depth"
        return
    above, error = (z if units == Units.ALTITUDE else None), ROUNDING
    if units == Units.HEIGHT and bounds.ground is not None:
        above, error = z - bounds.ground, MEASURED
    if isinstance(maneuver, imc.Takeoff) and (units == Units.NONE or (above is not None and above <= 0.0)):
        yield "a Takeoff needs an altitude or height above the ground"
    if above is not None and (highest := above + max(points, default=0.0)) > bounds.altitude + error:
        yield f"an altitude of {highest:.0f} m is above the limit of {bounds.altitude:.0f} m"
