"""Follows another system at a distance."""

import math
from typing import ClassVar, NamedTuple

import imc
from imc.coordinates import absolute_position
from runtime import param
from support.log_limit import ReportLimit
from support.planar_geometry import north_and_east
from support.wgs84 import displace, ground_distance, is_on_earth, offset
from tasks.maneuver.maneuver_task import Loops, Maneuver, ManeuverError, PathEnd, PathFlags

JUMP = 50.0  # m between two positions of a system that rests
NOWHERE = (0.0, 0.0)  # announced by a system without a position


class _Sighting(NamedTuple):
    """A place of the system: latitude, longitude (rad), depth (m), course that offsets turn with (rad), time (s)."""

    lat: float
    lon: float
    depth: float
    course: float
    time: float


class FollowSystem(Maneuver):
    """Goes to a place beside a system that sends RemoteState or Announce, for the duration; 0 is forever.

    The place is `x` (m) ahead of the system and `y` (m) to port, as in DUNE, along its heading; Announce has none, so
    that its course over ground is used, or for `Heading Cooldown` the heading of the last RemoteState. A RemoteState
    has a depth, to which `z` is added. The vehicle rests near the place, without a loitering radius, and whenever the
    system is nearer than the safe distance. No position for the timeout ends the maneuver with an error.
    """

    subscribed: ClassVar[tuple[type[imc.Message], ...]] = (imc.PathControlState, imc.EstimatedState)
    subscribed_from_others: ClassVar[tuple[type[imc.Message], ...]] = (imc.Announce, imc.RemoteState)
    loops: ClassVar[int | None] = 0

    loitering_radius: float = param(-1.0, "m", "Radius of circles at the place; at most 0 rests there.")
    timeout: float = param(60.0, "s", "Time without a position that ends the maneuver.", minimum=1)
    using_announce: bool = param(False, "", "Follow the positions in Announce.")
    using_remote_state: bool = param(False, "", "Follow RemoteState.", name="Using RemoteState")
    min_displace: float = param(2.0, "m", "The system has a new course after this way.", minimum=0)
    heading_cooldown: float = param(15.0, "s", "Time for which the heading of a RemoteState counts.", minimum=0)
    minimum_safe_distance: float = param(15.0, "m", "Nearer to the system the vehicle rests.", minimum=0)
    maximum_distance: float = param(
        2000.0, "m", "A position farther away is rejected: anybody may announce one.", minimum=1
    )

    maximum_speed: float = param(
        20.0, "m/s", "A position that the system could only reach faster is rejected: two may use its id.", minimum=0.1
    )

    async def execute(self, order: imc.FollowSystem) -> None:
        if not (self.using_announce or self.using_remote_state):
            raise ManeuverError("neither Using Announce nor Using RemoteState is set")
        if order.system == self.system:
            raise ManeuverError("a vehicle cannot follow itself")
        self._order, self._heading = order, -math.inf
        self._seen: _Sighting | None = None
        self._mark: tuple[float, float] | None = None  # where the course over ground begins
        self._rejected = ReportLimit()
        began = received = self.now
        end = began + order.duration if order.duration else math.inf
        await self.wait_for_state()
        while self.now < end:
            if self.age(received) > self.timeout:
                raise ManeuverError(f"no position of {self._name()} for {self.timeout:g} s")
            event = await self.next_message()
            if isinstance(event, imc.Announce | imc.RemoteState):
                if (sighting := self._sight(event)) is not None:
                    received = self.now
                    self._follow(sighting)
            elif event is self.path:
                self.report_progress(end - self.now)
                if self.is_near_end and self.loitering_radius <= 0.0:
                    self.set_control_loops(0)
            elif self._is_too_near():
                self.set_control_loops(0)
        if self._seen is None:
            raise ManeuverError(f"no position of {self._name()} in {order.duration:g} s")

    def _sight(self, report: imc.Announce | imc.RemoteState) -> _Sighting | None:
        """The position in a report of the system that is to be followed; None if it does not count."""
        used = self.using_remote_state if isinstance(report, imc.RemoteState) else self.using_announce
        place = (report.lat, report.lon)
        if not used or report.src != self._order.system or place == NOWHERE:
            return None
        if why := self._reject_reason(*place):
            if self._rejected.is_due(why):
                self.log.warning(f"rejecting a position of {self._name()}: {why}")
            return None
        if isinstance(report, imc.RemoteState):
            self._heading = self.now
            course = report.psi if math.isfinite(report.psi) else 0.0
            return _Sighting(*place, float(report.depth), course, self.now)
        return _Sighting(*place, 0.0, self._course(*place), self.now)

    def _reject_reason(self, lat: float, lon: float) -> str:
        """Reason why the system is not at a position, "" if it may be there."""
        if not is_on_earth(lat, lon) or math.hypot(*self.north_east_from_vehicle(lat, lon)) > self.maximum_distance:
            return f"it is beyond {self.maximum_distance:g} m"
        if self._seen is None:
            return ""
        away = ground_distance(self._seen.lat, self._seen.lon, lat, lon)
        reach = JUMP + self.maximum_speed * (self.now - self._seen.time)  # it moves while this process stands still
        return "" if away <= reach else f"it would have moved faster than {self.maximum_speed:g} m/s"

    def _course(self, lat: float, lon: float) -> float:
        """The course (rad) of a system that announces a position."""
        before = self._seen
        if before is None or self._mark is None:
            self._mark = (lat, lon)
            return 0.0 if before is None else before.course
        north, east = offset(*self._mark, lat, lon)
        if math.hypot(north, east) < self.min_displace:
            return before.course
        self._mark = (lat, lon)
        return before.course if self.age(self._heading) <= self.heading_cooldown else math.atan2(east, north)

    def _follow(self, seen: _Sighting) -> None:
        order = self._order
        self._seen = seen
        if self._is_too_near(seen):
            self.set_control_loops(0)
            return
        lat, lon, _ = displace(seen.lat, seen.lon, 0.0, *north_and_east(order.x, -order.y, seen.course))
        z = order.z + seen.depth if order.z_units == imc.ZUnits.DEPTH else order.z
        self.set_control_loops(Loops.PATH)
        leg = PathEnd(lat, lon, z, order.z_units, order.speed, order.speed_units)
        self.start_path(leg, radius=max(0.0, self.loitering_radius), flags=PathFlags.DIRECT)

    def _is_too_near(self, seen: _Sighting | None = None) -> bool:
        at = seen or self._seen
        if at is None or self.state is None:
            return False
        lat, lon, _ = absolute_position(self.state)
        return ground_distance(lat, lon, at.lat, at.lon) < self.minimum_safe_distance

    def _name(self) -> str:
        return self.vehicle.systems.name(self._order.system)
