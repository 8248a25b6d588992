"""Ranges of the numbers of maneuvers: wider than any vehicle needs, so each plan that can be flown is accepted."""

from collections.abc import Iterator, Mapping

import imc
from autonomy.plans.graph import HEIGHTS, PlanGraph

SEA = 11_000.0  # m; no sea is deeper
LEG = 25_000.0  # m; path control follows no longer leg
AWAY = 1e6  # m; beyond this a plane is no map of the Earth
LATEST = 4_102_444_800.0  # s since 1970: the year 2100
ANGLE = 1000.0  # rad, also for angles written in degrees; the sine of much larger numbers means nothing
RPM = 20_000.0
STEEPEST = (-1.58, 1.58, "rad")  # of a way up or down: a right angle, rounded up

Range = tuple[float, float, str]
RANGES: Mapping[str, Range] = {
    **dict.fromkeys((*HEIGHTS, "abort_z", "glide_slope_alt"), (-SEA, SEA, "m")),
    **dict.fromkeys(("radius", "loiter_radius", "length", "hstep", "amplitude", "altitude_interval"), (-LEG, LEG, "m")),
    **dict.fromkeys(("bearing", "cross_angle", "angaperture", "roll", "pitch", "yaw"), (-ANGLE, ANGLE, "rad")),
    "width": (0.0, AWAY, "m"),
    "rpm": (-RPM, RPM, "rpm"),
    "arrival_time": (-LATEST, LATEST, "s"),
    "timeout": (-AWAY, AWAY, "s"),
}
SPEEDS: Mapping[int, Range] = {
    imc.SpeedUnits.METERS_PS: (0.0, 100.0, "m/s"),
    imc.SpeedUnits.RPM: (0.0, RPM, "rpm"),
}
OFFSETS: Mapping[str, Range] = {"x": (-AWAY, AWAY, "m"), "y": (-AWAY, AWAY, "m"), "z": (-SEA, SEA, "m")}


def value_range_violations(graph: PlanGraph) -> Iterator[str]:
    """Objections to maneuvers with an absurd number; they name its field and the limit."""
    for name, node in graph.nodes.items():
        maneuver = node.maneuver
        ranges = dict(RANGES)
        if isinstance(maneuver, imc.YoYo | imc.CompassCalibration):
            ranges["pitch"] = STEEPEST
        if (speed := SPEEDS.get(getattr(maneuver, "speed_units", -1))) is not None:
            ranges["speed"] = speed
        yield from (f"{name}: {reason}" for reason in _outside(maneuver, ranges))
        for number, point in enumerate(getattr(maneuver, "points", ())):
            yield from (f"{name}: point {number}: {reason}" for reason in _outside(point, OFFSETS))


def _outside(values: imc.Message, ranges: Mapping[str, Range]) -> Iterator[str]:
    for field, (lowest, highest, unit) in ranges.items():
        value = getattr(values, field, 0.0)
        if value > highest:
            yield f"{field} {value:g} {unit} is more than {highest:.10g} {unit}"
        elif value < lowest:
            yield f"{field} {value:g} {unit} is less than {lowest:.10g} {unit}"
