"""One path for an autopilot: where it leads, how far the vehicle has come, and the point to send it to."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import imc
from autonomy.guidance import (
    PathProgress,
    Track,
    circle_side,
    eta_field,
    is_valid_path,
    length_violation,
    loiters_here,
    path_control_state,
    progress,
)
from mavlink.autopilot.vehicle_modes import SteeredVehicle
from support.rotations import wrap
from support.wgs84 import displace, ground_distance, offset

Flags = imc.DesiredPath.Flags
Units = imc.ZUnits
WHERE: Mapping[int, str] = {
    Units.DEPTH: "a depth",
    Units.ALTITUDE: "an altitude above the bottom",
    Units.HEIGHT: "a height",
}
SLOWEST = 0.2  # m/s; least speed for an ETA and for a course
LEAD = 2.0  # s that the target is ahead on a circle
LARGEST_LEAD = math.radians(40.0)
ON_CIRCLE = 2.0  # m, or a quarter of the radius
CORRECTION = 0.02  # of the error of the radius, with each target
LARGEST_CORRECTION = 0.35  # of the radius
AIRBORNE = 1.0  # m above home; higher, it is in the air
PLANE_AIRBORNE = 15.0  # m; higher, a plane has taken off
IN_AIR = 2  # MAV_LANDED_STATE


@dataclass(frozen=True, slots=True)
class ReportedPosition:
    """Position that an autopilot reports: position (rad), heights (m) above the sea and above home, motion (m/s, rad).

    airspeed: m/s, not a number if it is unknown.
    """

    lat: float
    lon: float
    amsl: float
    above_home: float
    vx: float = 0.0
    vy: float = 0.0
    vz: float = 0.0
    psi: float = 0.0
    airspeed: float = math.nan


@dataclass(frozen=True, slots=True)
class ArrivalTolerance:
    """Tolerance of an arrival: horizontal and vertical distance (m) from the end."""

    horizontal: float
    vertical: float


def is_airborne(vehicle: SteeredVehicle, at: ReportedPosition, *, sent: bool, landed_state: int) -> bool:
    """Whether a takeoff needs no command of its own (`sent`): it is in the air, and did not take off just now."""
    if vehicle.roams:
        return at.above_home > PLANE_AIRBORNE
    return not sent and (at.above_home > AIRBORNE or landed_state == IN_AIR)


def path_height_above_home(
    path: imc.DesiredPath, at: ReportedPosition, undulation: float, *, flies: bool, dives: bool
) -> float:
    """The height (m) above home at the end of a path. Raises ValueError if this vehicle cannot go there."""
    if path.flags & Flags.NO_Z or path.end_z_units == Units.NONE:
        return at.above_home
    if path.end_z_units == Units.HEIGHT and flies:
        return path.end_z - undulation - at.amsl + at.above_home
    if path.end_z_units == Units.ALTITUDE and flies:
        return path.end_z
    if path.end_z_units != Units.DEPTH or flies:
        raise ValueError(f"this autopilot cannot go to {WHERE.get(path.end_z_units, 'this kind of z')}")
    if path.end_z > 0.0 and not dives:
        raise ValueError("this vehicle cannot dive")
    return -path.end_z


class Leg:
    """A path from where the vehicle is to its end, or to a circle around it; `height` is above home (m).

    Raises ValueError if the path cannot be followed.
    """

    def __init__(self, path: imc.DesiredPath, at: ReportedPosition, height: float) -> None:
        if not is_valid_path(path):
            raise ValueError("the desired path has an invalid position or number")
        if path.speed_units != imc.SpeedUnits.METERS_PS or path.speed <= 0.0:
            raise ValueError("the speed for an autopilot must be in m/s, and more than 0")
        here = path.flags & Flags.TAKEOFF or loiters_here(path)
        self.lat: float
        self.lon: float
        self.lat, self.lon = (at.lat, at.lon) if here else (path.end_lat, path.end_lon)
        self.path: imc.DesiredPath = path
        self.height: float = height
        self.speed: float = path.speed
        self.takes_off: bool = bool(path.flags & Flags.TAKEOFF)
        self.lands: bool = bool(path.flags & Flags.LAND)
        self.radius: float = max(0.0, path.lradius)
        self.side: int = circle_side(path)
        self.near: bool = False
        self.loitering: bool = False
        self.arrived: bool = False
        self.item: int | None = None  # of the mission in the autopilot's memory
        self.start = 0  # the item to begin with, for those that come before it
        self._origin = at.lat, at.lon
        self._correction = 0.0  # m by which the targets are outside the circle
        self._track = Track((0.0, 0.0), self._offset(self.lat, self.lon))
        if violation := length_violation(self._track.length):
            raise ValueError(violation)

    def update_arrival(self, at: ReportedPosition, tolerance: ArrivalTolerance) -> bool:
        """Take where the vehicle is; True if it has just arrived at the end, or on the circle."""
        before = self.near, self.loitering
        off, away = abs(self.height - at.above_home), self._away(at)
        if self.radius:
            self.loitering = self.loitering or (
                abs(away - self.radius) < max(ON_CIRCLE, 0.25 * self.radius)
                and off < max(ON_CIRCLE, tolerance.vertical)
            )
        else:
            self.arrived = self.arrived or (
                off <= tolerance.vertical and (self.takes_off or away <= tolerance.horizontal)
            )
            self.near = self.near or (self.arrived and not self.lands)
        return before != (self.near, self.loitering)

    def mark_arrived(self) -> bool:
        """The autopilot itself reports that it has arrived; True if that is new."""
        before = self.near
        self.arrived = True
        self.near = not self.lands and not self.radius
        return before != self.near

    def steering_target(self, at: ReportedPosition) -> tuple[float, float]:
        """Present target of the vehicle (rad): the end, or a point that moves ahead on the circle."""
        return self._ahead_on_circle(at, LEAD) if self.radius else (self.lat, self.lon)

    def _ahead_on_circle(self, at: ReportedPosition, lead: float, *, tangential: bool = False) -> tuple[float, float]:
        """A point that is `lead` s ahead on the circle, farther out or in by what was missed so far.

        tangential: for one that always heads for it; others are carried out as far as these would cut the corner.
        """
        north, east = offset(self.lat, self.lon, at.lat, at.lon)
        if self.loitering:
            most = LARGEST_CORRECTION * self.radius
            missed = self.radius - math.hypot(north, east)
            self._correction = max(-most, min(most, self._correction + CORRECTION * missed))
        turn = min(LARGEST_LEAD, lead * self.speed / self.radius)
        angle = math.atan2(east, north) + self.side * turn
        out = self.radius / (math.cos(turn) if tangential else 1.0) + self._correction
        return displace(self.lat, self.lon, 0.0, out * math.cos(angle), out * math.sin(angle))[:2]

    def point_ahead(self, at: ReportedPosition, lead: float) -> tuple[float, float]:
        """A point on the line to the end (rad), or on the circle, that is `lead` s ahead, or the end itself.

        Who is always sent there goes at the speed of the leg, if it approaches by 1/lead of the distance each second.
        """
        if self.radius:
            return self._ahead_on_circle(at, lead, tangential=True)
        track = self._track
        along = progress(track, self._offset(at.lat, at.lon), 0.0, 0.0, 0.0).x + lead * self.speed
        if along >= track.length:
            return self.lat, self.lon
        north, east = along * math.cos(track.bearing), along * math.sin(track.bearing)
        return displace(*self._origin, 0.0, north, east)[:2]

    def progress(self, at: ReportedPosition) -> PathProgress:
        """Distance that the vehicle has covered; a climb counts as distance."""
        speed, course = math.hypot(at.vx, at.vy), math.atan2(at.vy, at.vx)
        where = progress(self._track, self._offset(at.lat, at.lon), speed, course, at.psi)
        climb = abs(self.height - at.above_home)
        left = abs(self._away(at) - self.radius) if self.radius else math.hypot(where.left, climb)
        return PathProgress(
            x=where.x,
            y=self._away(at) - self.radius if self.loitering else where.y,
            left=left,
            range=where.range,
            line_of_sight=where.line_of_sight,
            speed=speed,
            course=course,
            psi=at.psi,
            vx=where.vx,
            vy=where.vy,
        )

    def path_control_state(self, at: ReportedPosition) -> imc.PathControlState:
        """The state of the path."""
        where, path = self.progress(at), self.path
        path = path.replace(start_lat=self._origin[0], start_lon=self._origin[1], end_lat=self.lat, end_lon=self.lon)
        left = 0.0 if self.near or self.loitering else where.left
        return path_control_state(path, near=self.near, loitering=self.loitering).replace(
            x=left,
            y=where.y,
            z=at.above_home - self.height,  # as a depth error, positive if the end is deeper
            vx=where.vx,
            vy=where.vy,
            vz=at.vz,
            course_error=wrap(where.line_of_sight - where.course) if where.speed > SLOWEST else 0.0,
            eta=eta_field(left / max(SLOWEST, self.speed)),
        )

    def _away(self, at: ReportedPosition) -> float:
        return ground_distance(at.lat, at.lon, self.lat, self.lon)

    def _offset(self, lat: float, lon: float) -> tuple[float, float]:
        return offset(*self._origin, lat, lon)
