"""Bounds of a plan: the allowed depth, area and altitude, and a takeoff before any flight."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import imc
from autonomy.limits import PLAN_MARGIN, OperatingLimits
from autonomy.plans.estimate import waypoints
from autonomy.plans.graph import HEIGHTS, ROUNDING, PlanGraph
from imc.coordinates import area_contains

Limit = imc.OpLimitsMask
Units = imc.ZUnits
MEASURED = 0.5  # m by which the height of the ground may be off
ANYWHERE = imc.Takeoff | imc.IdleManeuver | imc.Land  # allowed on the ground as well


def is_airborne(medium: imc.VehicleMedium | None) -> bool:
    """Whether an aircraft counts as in the air, so that a plan may begin without a Takeoff; not if that is unknown."""
    return medium is not None and medium.medium == imc.VehicleMedium.Medium.AIR


@dataclass(frozen=True)
class PlanBounds:
    """Current limits; `ground` is the height (m above the ellipsoid) of the ground, None if unknown."""

    limits: imc.OperationalLimits | None = None
    highest: float = math.inf
    ground: float | None = None
    airborne: bool = False

    @property
    def max_altitude(self) -> float:
        """The highest altitude (m above ground)."""
        own = OperatingLimits(highest=self.highest)
        return (own.tightened(self.limits) if self.limits is not None else own).highest


def depth_violations(graph: PlanGraph, deepest: float) -> Iterator[str]:
    """Objections to maneuvers deeper than `deepest` (m) less PLAN_MARGIN; with 0 m the vehicle stays at the surface."""
    afloat = ", the vehicle stays at the surface" if deepest <= 0.0 else ""
    reachable = max(0.0, deepest - PLAN_MARGIN)
    for name, node in graph.nodes.items():
        maneuver = node.maneuver
        for z in HEIGHTS if 0.0 < deepest < math.inf else ():
            unit = getattr(maneuver, f"{z}_units", Units.DEPTH)
            if unit == Units.NONE and z != "z" and not getattr(maneuver, z, 0.0):
                continue  # the vehicle floats up by itself
            if unit not in (Units.DEPTH, Units.ALTITUDE):
                yield f"{name}: {z} is neither a depth nor an altitude"
        if (wanted := max(_depths(maneuver), default=0.0)) > reachable + ROUNDING:
            held = afloat or f": {wanted:g} m, the vehicle goes down to {reachable:g} m"
            yield f"{name}: maneuver depth beyond limits{held}"
        if afloat and any(getattr(maneuver, f"{z}_units", None) == Units.ALTITUDE for z in HEIGHTS):
            yield f"{name}: maneuver at an altitude{afloat}"


def _depths(maneuver: imc.Message) -> Iterator[float]:
    """The depths (m) to which a maneuver goes."""
    reach = maneuver.amplitude if isinstance(maneuver, imc.YoYo | imc.CompassCalibration) else 0.0
    points: Iterable[object] = getattr(maneuver, "points", ())
    for name in HEIGHTS:
        if getattr(maneuver, f"{name}_units", None) == Units.DEPTH:
            z = getattr(maneuver, name)
            yield z + reach
            yield from (z + point.z for point in points if isinstance(point, imc.PathPoint))


def area_violations(graph: PlanGraph, bounds: PlanBounds) -> Iterator[str]:
    """Objections to maneuvers that leave the area of the limits, and to limits that are not numbers."""
    area = bounds.limits
    if area is not None and not all(map(math.isfinite, _numbers(area))):
        yield "the operational limits have a value that is not a number"
        return
    if area is None or not area.mask & Limit.AREA:
        return
    for name, node in graph.nodes.items():
        circle = isinstance(node.maneuver, imc.Loiter | imc.CompassCalibration)
        margin = getattr(node.maneuver, "radius", 0.0) if circle else 0.0
        for lat, lon in waypoints(node.maneuver):
            if not area_contains(area, lat, lon, margin):
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
    if above is not None and (highest := above + max(points, default=0.0)) > bounds.max_altitude + error:
        yield f"an altitude of {highest:.0f} m is above the limit of {bounds.max_altitude:.0f} m"
