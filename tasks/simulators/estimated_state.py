"""Simulates the motion of the vehicle, without forces."""

import math
from collections.abc import Iterator, Mapping
from typing import ClassVar

import imc
from runtime import ConfigWarning, ParameterError, State, Task, param, periodic
from runtime.task import SharedOption
from support.wgs84 import offset
from tasks.simulated_world import chart_warnings, log_chart, log_unknown_depth, world_of
from tasks.true_motion import simulated_state
from world import SECTIONS
from world.bodies import (
    CirclePattern,
    LegsPattern,
    LinePattern,
    Pattern,
    PatternMotion,
    lawn_mower_corners,
    parse_points,
)

LOOKAHEAD_TIME = 5.0  # s
CLEARANCE = 0.5  # m above an uneven bottom
GRID = 2.0  # m, after which it looks at the ground around it again
AHEAD = 30.0  # m, in which it dives a few meters
AROUND = (
    (0.0, 0.0),
    *((AHEAD * math.cos(k * math.pi / 4.0), AHEAD * math.sin(k * math.pi / 4.0)) for k in range(8)),
)


class EstimatedState(Task):
    """Moves the vehicle along a pattern; publishes the truth and an estimate that equals it.

    The vehicle starts on the surface, at rest, and dives after `Surface Time`. The bottom is that of [World]; without
    one it is flat. It keeps above the ground within 30 m, but goes through walls.
    """

    reads: ClassVar[Mapping[str, Mapping[str, SharedOption]]] = SECTIONS
    transient: ClassVar[tuple[str, ...]] = ("_seabed",)

    pattern: str = param(
        "Circle",
        "",
        "Path over ground.",
        choices=("Hover", "Line", "Circle", "Lawn-mower", "Waypoints"),
        editable=False,
    )
    speed: float = param(1.5, "m/s", "Speed through the water.", minimum=0, maximum=5)
    turn_rate: float = param(15.0, "°/s", "Largest rate of turn.", minimum=1, maximum=90)
    vertical_mode: str = param("Depth", "", "Quantity to hold: depth or altitude.", choices=("Depth", "Altitude"))
    depth: float = param(3.0, "m", "Depth below the surface.", minimum=0, maximum=11000)
    altitude: float = param(10.0, "m", "Height above the bottom.", minimum=0, maximum=11000)
    bottom_depth: float = param(
        13.0,
        "m",
        "Depth of a flat bottom if [World] and [Bathymetry] have none; -1 if unknown.",
        minimum=-1,
        maximum=11000,
        editable=False,
    )
    maximum_pitch: float = param(15.0, "°", "Steepest pitch when it dives.", minimum=1, maximum=60)
    surface_time: float = param(10.0, "s", "Time on the surface before the first dive.", minimum=0, editable=False)
    start_latitude: float = param(41.185, "°", "Latitude of the start.", minimum=-89, maximum=89, editable=False)
    start_longitude: float = param(-8.7062, "°", "Longitude of the start.", minimum=-180, maximum=180, editable=False)
    start_heading: float = param(
        0.0, "°", "Heading at the start, true north.", minimum=-360, maximum=360, editable=False
    )
    circle_radius: float = param(
        20.0, "m", "Radius of the circle, which begins at the start and turns to starboard.", minimum=1, editable=False
    )
    leg_length: float = param(50.0, "m", "Length of the lawn-mower's legs.", minimum=1, editable=False)
    leg_spacing: float = param(10.0, "m", "Distance between the lawn-mower's legs.", minimum=1, editable=False)
    leg_count: int = param(4, "1", "Number of the lawn-mower's legs.", minimum=1, maximum=1000, editable=False)
    waypoints: list[str] = param(
        [],
        "",
        'North, east and optionally depth (m, from the start) of each waypoint: "50 0, 50 20 5".',
        editable=False,
    )
    current_north: float = param(0.0, "m/s", "Northward velocity of the water.", minimum=-3, maximum=3, editable=False)
    current_east: float = param(0.0, "m/s", "Eastward velocity of the water.", minimum=-3, maximum=3, editable=False)
    simulated_state_rate: float = param(100.0, "Hz", "Rate of SimulatedState.", minimum=0.1, maximum=1000)
    estimated_state_rate: float = param(20.0, "Hz", "Rate of EstimatedState.", minimum=0.1, maximum=1000)

    motion: PatternMotion

    def configure(self) -> None:
        self.origin: tuple[float, float] = math.radians(self.start_latitude), math.radians(self.start_longitude)
        self._seabed = world_of(self).seabed
        self._offset = offset(*self._seabed.reference, *self.origin) if self._seabed is not None else (0.0, 0.0)
        self._require_one_bottom()
        target, path = self._target_depth(), self._path()
        if not hasattr(self, "motion"):
            current = self.current_north, self.current_east
            self.motion = PatternMotion(path, math.radians(self.start_heading), current, dive_time=self.surface_time)
        self.motion.speed = self.speed
        self.motion.depth_target = target
        self._looked: tuple[int, int] | None = None
        self._avoid_bottom()
        self.motion.turn_rate = math.radians(self.turn_rate)
        self.motion.maximum_pitch = math.radians(self.maximum_pitch)

    def configuration_warnings(self) -> Iterator[ConfigWarning]:
        yield from chart_warnings(self)

    def start(self) -> None:
        self._last = self.now_ns
        self._is_off_chart = False
        log_chart(self)
        self.set_entity_state(State.NORMAL, "active")

    @periodic("simulated_state_rate")
    def publish_simulated_state(self) -> None:
        m = self._advance()
        place = self._offset[0] + m.north, self._offset[1] + m.east
        self._is_off_chart = log_unknown_depth(self, *place, self._is_off_chart)
        stream = self.current_north, self.current_east, 0.0
        moved, angles, rates = (m.north, m.east, m.depth), (m.phi, m.theta, m.psi), (m.p, m.q, m.r)
        self.publish(simulated_state(moved, (m.u, m.v, m.w), angles, rates, stream, (*self.origin, 0.0)))

    @periodic("estimated_state_rate")
    def publish_estimated_state(self) -> None:
        m = self._advance()
        bottom = self._bottom(m.north, m.east)
        u, v, w = m.ground_velocity()
        self.publish(
            imc.EstimatedState(
                lat=self.origin[0],
                lon=self.origin[1],
                x=m.north,
                y=m.east,
                z=m.depth,
                phi=m.phi,
                theta=m.theta,
                psi=m.psi,
                u=u,
                v=v,
                w=w,
                vx=m.vn,
                vy=m.ve,
                vz=m.vd,
                p=m.p,
                q=m.q,
                r=m.r,
                depth=m.depth,
                alt=-1.0 if math.isinf(bottom) else max(0.0, bottom - m.depth),
            )
        )

    def _advance(self) -> PatternMotion:
        self._avoid_bottom()
        self.motion.advance((self.now_ns - self._last) * 1e-9)
        self._last = self.now_ns
        return self.motion

    def _require_one_bottom(self) -> None:
        """Reject a bottom of this task's own beside that of the world."""
        sea, given = self._seabed, self.vehicle.profile.value(self.name, "Bottom Depth")
        if sea is not None and given and (sea.has_soundings or sea.depth(0.0, 0.0) != self.bottom_depth):
            raise ParameterError(
                "Bottom Depth",
                "the bottom is that of [World] and [Bathymetry]: remove this option; for a flat one set [Bathymetry] "
                "Data to nothing, and [World] Out Of Bounds Depth",
            )

    def _bottom(self, north: float, east: float) -> float:
        """Depth (m) of the bottom at a place, m from the start; infinite if it is unknown."""
        if self._seabed is not None:
            return self._seabed.depth(self._offset[0] + north, self._offset[1] + east)
        return math.inf if self.bottom_depth < 0.0 else self.bottom_depth

    def _avoid_bottom(self) -> None:
        """Let the vehicle dive no deeper than the ground around it, or than its altitude above that allows."""
        m = self.motion
        here = round(m.north / GRID), round(m.east / GRID)
        if self._seabed is None or not self._seabed.has_soundings or here == self._looked:
            return
        self._looked = here
        bottom = min(self._bottom(m.north + n, m.east + e) for n, e in AROUND)
        m.max_depth = max(0.0, bottom - (self.altitude if self.vertical_mode == "Altitude" else CLEARANCE))
        if self.vertical_mode == "Altitude":
            m.depth_target = m.max_depth

    def _target_depth(self) -> float:
        bottom = self._bottom(0.0, 0.0)
        if self.vertical_mode == "Altitude":
            if math.isinf(bottom):
                raise ParameterError("Altitude", "needs a Bottom Depth")
            if self.altitude > bottom:
                raise ParameterError("Altitude", f"is above the surface: the water is {bottom:g} m deep")
            return bottom - self.altitude
        self._check_depth("Depth", self.depth)
        return self.depth

    def _check_depth(self, parameter: str, depth: float) -> None:
        if depth < 0.0:
            raise ParameterError(parameter, f"{depth:g} m is above the surface")
        uneven = self._seabed is not None and self._seabed.has_soundings
        if not uneven and depth > (bottom := self._bottom(0.0, 0.0)):
            raise ParameterError(parameter, f"{depth:g} m is below the bottom at {bottom:g} m")

    def _path(self) -> Pattern | None:
        if self.pattern == "Hover":
            return None
        if self.speed < 0.1:
            raise ParameterError("Speed", f"{self.pattern} needs at least 0.1 m/s")
        if math.hypot(self.current_north, self.current_east) > 0.8 * self.speed:
            raise ParameterError("Speed", "is too slow against the current")
        heading, lookahead = math.radians(self.start_heading), max(LOOKAHEAD_TIME * self.speed, 1.0)
        turn_radius = self.speed / math.radians(self.turn_rate)
        if self.pattern == "Line":
            return LinePattern(0.0, 0.0, heading, lookahead)
        if self.pattern == "Circle":
            radius = self.circle_radius
            if radius < turn_radius:
                raise ParameterError("Circle Radius", f"is less than the {turn_radius:.1f} m that the turn rate allows")
            return CirclePattern(-radius * math.sin(heading), radius * math.cos(heading), radius, lookahead)
        if self.pattern == "Lawn-mower":
            corners = lawn_mower_corners(self.leg_length, self.leg_spacing, self.leg_count, heading)
            return LegsPattern(corners, turn_radius, lookahead)
        return LegsPattern(self._waypoints(), turn_radius, lookahead)

    def _waypoints(self) -> list[tuple[float, float, float | None]]:
        try:
            rows = parse_points(self.waypoints, (2, 3))
        except ValueError as error:
            raise ParameterError("Waypoints", str(error)) from None
        points: list[tuple[float, float, float | None]] = [(0.0, 0.0, None)]
        for row in rows:
            depth = row[2] if len(row) > 2 else None
            if depth is not None:
                self._check_depth("Waypoints", depth)
            if math.hypot(row[0] - points[-1][0], row[1] - points[-1][1]) < 1.0:
                raise ParameterError("Waypoints", f"{row[0]:g} {row[1]:g} is less than 1 m from the previous one")
            points.append((row[0], row[1], depth))
        if math.hypot(points[-1][0], points[-1][1]) < 1.0:
            points = [points[-1], *points[1:-1]]
        if len(points) < 2:
            raise ParameterError("Waypoints", "needs a point away from the start")
        return points
