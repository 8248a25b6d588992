"""Leads a multirotor along a line or around a circle in space, to takeoffs and landings too."""

import math
from dataclasses import dataclass

import imc
from autonomy.guidance.path_following_velocity import Circle, Line, MotionLimits
from autonomy.guidance.track import PathProgress
from support.rotations import Vector, wrap

HEADS = 2.0  # m; a shorter line does not change the heading
ON_CIRCLE = 2.0  # m
SLOWEST = 0.2  # m/s; least speed for an ETA and for a course
NOWHERE = Line((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


@dataclass(frozen=True)
class MultirotorGuidanceGains:
    """Conditions at which a path is done and a landing ends."""

    near_radius: float  # m from the end, where a path is done
    takeoff_tolerance: float  # m from its height, where a takeoff is done
    landing_rate: float  # m/s of descent near the ground
    landing_altitude: float  # m, below which the landing rate applies


class MultirotorGuidance:
    """Velocity and heading along `line`, or around `circle` at its end.

    The vehicle is `near` at the end of the line, `loitering` on the circle, and `landing` below the end of a line.
    """

    def __init__(self, gains: MultirotorGuidanceGains):
        self.gains = gains
        self.begin(NOWHERE, None, 0.0)

    def begin(
        self, line: Line, circle: Circle | None, heading: float, *, takes_off: bool = False, lands: bool = False
    ) -> None:
        """Begin a path; the vehicle keeps its heading (rad) where the path has no direction over ground."""
        self.line: Line = line
        self.circle = circle
        self.heading: float = heading
        self._takes_off, self._lands = takes_off, lands
        self.near: bool = False
        self.loitering: bool = False
        self.landing: bool = False

    def update_path_coordinates(self, line: Line, circle: Circle | None) -> None:
        """Continue along a line and a circle that have moved."""
        self.line, self.circle = line, circle

    def step(self, state: imc.EstimatedState, limits: MotionLimits, *, stands: bool = False) -> Vector:
        """Velocity (m/s north, east, down) here; `stands` is True on the ground."""
        at = state.x, state.y, state.z
        if self.circle is not None:
            return self._around(self.circle, at, limits)
        line, gains = self.line, self.gains
        arrived = math.dist(at, line.end) <= gains.near_radius and not stands
        if self._takes_off:
            arrived = arrived and abs(at[2] - line.end[2]) <= gains.takeoff_tolerance
        if self._lands:
            self.landing, arrived = self.landing or arrived, stands
        self.near = self.near or arrived
        if line.horizontal_length > HEADS:
            self.heading = line.bearing
        if not self.landing:
            return line.velocity(at, limits)
        north, east, _ = limits.velocity_to((line.end[0] - at[0], line.end[1] - at[1], 0.0))
        low = state.alt < gains.landing_altitude
        return north, east, gains.landing_rate if low else limits.descent

    def _around(self, circle: Circle, at: Vector, limits: MotionLimits) -> Vector:
        wanted = circle.velocity(at, limits)
        if abs(circle.distance_outside(at)) < ON_CIRCLE and abs(circle.center[2] - at[2]) < ON_CIRCLE:
            self.loitering = True
        if math.hypot(wanted[0], wanted[1]) > SLOWEST:
            self.heading = math.atan2(wanted[1], wanted[0])
        return wanted

    def progress(self, state: imc.EstimatedState) -> PathProgress:
        """Position of the vehicle on its path, and its motion."""
        line, circle, at = self.line, self.circle, (state.x, state.y, state.z)
        left, across = line.distance_to_end(at), line.cross_track_distance(at)
        if self.landing:
            left = state.alt
        elif circle is not None:
            across = circle.distance_outside(at)
            left = abs(across) + abs(circle.center[2] - at[2])
        bearing = line.bearing if line.horizontal_length > 0.1 else math.atan2(state.vy, state.vx)
        speed, course = math.hypot(state.vx, state.vy), math.atan2(state.vy, state.vx)
        drift = wrap(course - bearing) if speed > SLOWEST else 0.0
        return PathProgress(
            x=math.dist(line.start, line.end) - left,
            y=0.0 if circle is not None and not self.loitering else across,
            left=left,
            range=math.dist(at, line.end),
            line_of_sight=bearing,
            speed=speed,
            course=wrap(bearing + drift),
            psi=state.psi,
            vx=speed * math.cos(drift),
            vy=speed * math.sin(drift),
        )

    def eta(self, where: PathProgress, speed: float) -> float:
        """Time to the end of the path (s) at a speed (m/s); 0 at the end and on the circle."""
        if self.near or self.loitering:
            return 0.0
        return abs(where.left) / max(SLOWEST, self.gains.landing_rate if self.landing else speed)
