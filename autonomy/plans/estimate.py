"""Estimates the time, distance and energy of maneuvers."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import imc
from imc.coordinates import maneuver_corner_offsets
from imc.tuple_list import parse_tuple_list
from support.interpolation import interpolate
from support.wgs84 import displace, ground_distance

LatLon = tuple[float, float]  # latitude, longitude (rad)
CLIMB = math.sin(math.radians(15.0))  # vertical speed as a part of the forward speed
CRUISE = 1.0  # m/s, of maneuvers without a speed
LANDING = 0.5  # m/s, of the last meters above the ground
SMALLEST_CIRCLE = 5.0  # m, of CompassCalibration
LATENESS = 3.0  # s by which a ScheduledGoto may be late
SURFACE = 0.5  # m; at a smaller depth a vehicle keeps station adrift


@dataclass(frozen=True)
class Powertrain:
    """Tables of speed (m/s), propeller speed (rpm), actuation (%) and power (W), and the hotel load (W).

    The first three fields are one table, `power_rpms` and `powers` another. A point counts as reached `ahead` s early.
    `circles` is whether the vehicle circles at a station under water that leaves this open. A multirotor stops at
    each point, with `acceleration` (m/s²). A ScheduledGoto has a speed from `slowest` to `fastest` (m/s), and a
    CompassCalibration ends after `turns`. From rest a vehicle is `run_up` (m) behind one that had its speed at once:
    the distance in which its mass gains speed against a drag that grows with the square, the same at each speed.
    """

    speeds: Sequence[float] = (0.0, 1.0)
    rpms: Sequence[float] = (0.0, 1000.0)
    actuations: Sequence[float] = (0.0, 100.0)
    power_rpms: Sequence[float] = (0.0, 1.0)
    powers: Sequence[float] = (0.0, 0.0)
    hotel: float = 0.0
    ahead: float = 5.0
    circles: bool = False
    acceleration: float = math.inf
    slowest: float = 0.7
    fastest: float = 1.6
    turns: float = 1.0
    run_up: float = 0.0

    def to_meters_per_second(self, value: float, units: int) -> float:
        """A speed in any unit, converted to m/s."""
        if units == imc.SpeedUnits.METERS_PS:
            return value
        return interpolate(value, self.rpms if units == imc.SpeedUnits.RPM else self.actuations, self.speeds)

    def power(self, speed: float) -> float:
        """Power (W) of the propulsion at a speed (m/s)."""
        return interpolate(interpolate(speed, self.speeds, self.rpms), self.power_rpms, self.powers)


class Vertical(NamedTuple):
    """Altitude of an aerial vehicle and height of the ground above the ellipsoid (m); NaN if unknown."""

    altitude: float = math.nan
    ground: float = math.nan

    def after(self, maneuver: imc.Message) -> "Vertical":
        """The altitude at which a maneuver leaves the vehicle."""
        if isinstance(maneuver, imc.Land):
            return self._replace(altitude=0.0)
        z, units = getattr(maneuver, "z", math.nan), getattr(maneuver, "z_units", imc.ZUnits.NONE)
        if units == imc.ZUnits.ALTITUDE:
            return self._replace(altitude=z)
        return self._replace(altitude=z - self.ground) if units == imc.ZUnits.HEIGHT else self


UNKNOWN_VERTICAL = Vertical()


@dataclass(frozen=True)
class ManeuverEstimate:
    """Duration of a maneuver: `seconds` (infinite if endless, NaN if unknown), `moving` of them at `speed` (m/s).

    `distance` is its length over ground (m; infinite if endless, NaN if unknown), `longest` its longest straight leg
    (m); `end` is the position after it, on a circle that of its center.
    """

    seconds: float = math.nan
    moving: float = 0.0
    speed: float = 0.0
    distance: float = math.nan
    longest: float = 0.0
    end: LatLon | None = None

    def delayed(self, seconds: float) -> "ManeuverEstimate":
        """The estimate with so much more time on the way."""
        return replace(self, seconds=self.seconds + seconds, moving=self.moving + seconds)


def estimate_maneuver(
    maneuver: imc.Message, start: LatLon | None, train: Powertrain, now: float, vertical: Vertical = UNKNOWN_VERTICAL
) -> ManeuverEstimate:
    """Estimate a maneuver from `start`; without it the way to the maneuver is not counted.

    A PopUp that waits for a fix takes at most the estimate. `now` is when the maneuver begins (s since 1970 UTC).
    """
    speed = train.to_meters_per_second(getattr(maneuver, "speed", CRUISE), getattr(maneuver, "speed_units", 0))
    duration = float(getattr(maneuver, "duration", 0))
    endless = duration or math.inf
    if isinstance(maneuver, imc.IdleManeuver):
        return ManeuverEstimate(endless, distance=0.0, end=start)
    if isinstance(maneuver, imc.Teleoperation | imc.FollowReference):
        return ManeuverEstimate(math.inf)  # its end is unknown
    if isinstance(maneuver, imc.FollowSystem):
        return ManeuverEstimate(endless, endless if duration else 0.0, speed)
    stations = waypoints(maneuver)
    if not stations and start and isinstance(maneuver, imc.Takeoff | imc.Land | imc.Elevator | imc.PopUp):
        stations = [start]
    if not stations or speed <= 0.0:
        return ManeuverEstimate(end=start)
    legs = [_distance(*leg) for leg in pairwise(([start] if start else []) + stations)]
    longest = max(legs, default=0.0)
    if isinstance(maneuver, imc.ScheduledGoto):
        return _estimate_scheduled(maneuver, longest, stations[-1], train, now)
    hovers = math.isfinite(train.acceleration)
    stop = speed / train.acceleration
    # Only at the last point: what is cut from a leg between two points is added to the next.
    travel = max(0.0, math.fsum(leg / speed + stop for leg in legs if leg > 0.0) - train.ahead)
    circling = waiting = 0.0
    if isinstance(maneuver, imc.Loiter):
        rests = hovers and maneuver.type == imc.Loiter.Type.HOVER
        circling, waiting = (0.0, endless) if rests else (endless, 0.0)
    elif isinstance(maneuver, imc.StationKeeping):
        rests = hovers or drifts_at_surface(maneuver, train.circles)
        circling, waiting = (0.0, endless) if rests else (endless, 0.0)
    elif isinstance(maneuver, imc.CompassCalibration):
        circling = min(endless, train.turns * math.tau * max(SMALLEST_CIRCLE, maneuver.radius) / speed)
    elif isinstance(maneuver, imc.YoYo):
        travel /= max(0.1, math.cos(maneuver.pitch))
    elif isinstance(maneuver, imc.Elevator):
        circling = abs(maneuver.end_z - maneuver.start_z) / (speed * CLIMB)
    elif isinstance(maneuver, imc.PopUp):
        circling, waiting = 2.0 * abs(maneuver.z) / (speed * CLIMB), duration
    elif isinstance(maneuver, imc.Takeoff | imc.Land):
        travel += _climb_or_descent(maneuver, speed, vertical)
    moving = travel + (circling if math.isfinite(circling) else 0.0)
    distance = math.fsum(legs) + speed * circling
    return ManeuverEstimate(travel + circling + waiting, moving, speed, distance, longest, stations[-1])


def _estimate_scheduled(
    maneuver: imc.ScheduledGoto, leg: float, end: LatLon, train: Powertrain, now: float
) -> ManeuverEstimate:
    """Circle at the slowest speed first if there is more time than the path takes."""
    left = maneuver.arrival_time - now
    needed = leg / left if left > 0.0 else math.inf
    if leg / train.fastest - left > LATENESS and maneuver.delayed != imc.ScheduledGoto.Delayed.RESUME:
        return ManeuverEstimate(end=end)  # it is done at once, or fails, as soon as it is too late
    speed = max(train.slowest, min(train.fastest, needed))
    seconds = max(0.0, max(left, leg / speed) - train.ahead)
    return ManeuverEstimate(seconds, seconds, speed, max(leg, speed * seconds), leg, end)


def _climb_or_descent(maneuver: imc.Takeoff | imc.Land, speed: float, vertical: Vertical) -> float:
    """Duration (s); NaN if the altitude at its begin or end is unknown."""
    if isinstance(maneuver, imc.Takeoff):
        begin = 0.0 if math.isnan(vertical.altitude) else vertical.altitude
        seconds = (vertical.after(maneuver).altitude - begin) / speed
    else:
        seconds = vertical.after(imc.Goto(z=maneuver.z, z_units=maneuver.z_units)).altitude / LANDING
    return 0.0 if seconds < 0.0 else seconds


def drifts_at_surface(station: imc.StationKeeping, circles: bool) -> bool:
    """Whether the vehicle drifts at the surface; under water it may circle, in the air it hovers.

    `circles` is whether it circles if the station leaves this open.
    """
    below = parse_tuple_list(station.custom).get("Under Water", "circle" if circles else "surface").lower()
    is_shallow = station.z <= SURFACE or below != "circle"
    return station.z_units == imc.ZUnits.NONE or (station.z_units == imc.ZUnits.DEPTH and is_shallow)


def waypoints(maneuver: imc.Message) -> list[LatLon]:
    """Positions of a maneuver; empty if it has none. Raises ValueError for invalid rows."""
    lat, lon = getattr(maneuver, "lat", None), getattr(maneuver, "lon", None)
    if lat is None or lon is None or isinstance(maneuver, imc.Takeoff):
        return []
    if isinstance(maneuver, imc.Land) and (lat, lon) == (0.0, 0.0):
        return []
    if isinstance(maneuver, imc.Elevator | imc.PopUp) and maneuver.flags & imc.Elevator.Flags.CURR_POS:
        return []
    offsets: Iterable[tuple[float, float]] = [(0.0, 0.0)]
    if isinstance(maneuver, imc.FollowPath):
        offsets = [(point.x, point.y) for point in maneuver.points if isinstance(point, imc.PathPoint)]
    elif isinstance(maneuver, imc.Rows | imc.RowsCoverage):
        offsets = maneuver_corner_offsets(maneuver)
    return [displace(lat, lon, 0.0, north, east)[:2] for north, east in offsets]


def _distance(start: LatLon, end: LatLon) -> float:
    return ground_distance(*start, *end)
