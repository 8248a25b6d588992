"""Leads a vehicle along a straight track, or to a circle and around it, by its heading."""

import math
from dataclasses import dataclass
from typing import Protocol

import imc
from autonomy.guidance.track import PathProgress, Track, progress
from support.number_parsing import clamp_magnitude
from support.planar_geometry import bearing
from support.rotations import wrap

SLOWEST_COURSE = 0.2  # m/s; a slower vehicle has no course
LARGEST_DRIFT = math.radians(60.0)  # between heading and course; no heading corrects more drift than this
NOWHERE = Track((0.0, 0.0), (0.0, 0.0))


class SteeringLaw(Protocol):
    """The course to follow a track."""

    def line_course(self, where: PathProgress, bearing: float) -> float:
        """Course (rad) that follows a straight track of a `bearing` (rad)."""
        ...

    def circle_course(self, line_of_sight: float, distance: float, radius: float, side: int) -> float:
        """Course (rad) around a circle with its center at a direction (rad) and distance (m); side 1 is clockwise."""
        ...


@dataclass(frozen=True)
class TrackGuidanceGains:
    """Settings of TrackGuidance."""

    controls_course: bool = True  # else the heading
    arrival_time: float = 5.0  # s before the end of a track, when the vehicle arrives
    slowest: float = 0.1  # m/s, least speed assumed for the time of arrival


class TrackGuidance:
    """The heading along `track`: a line to its end, or with a radius a tangent to a circle and the circle.

    The vehicle is `near` at the end of a line, and `loitering` on a circle. After a step, `where` is its progress,
    `course` its course or heading, `target` the one to steer (rad), and `eta` the time to the end (s).
    """

    def __init__(self, gains: TrackGuidanceGains, law: SteeringLaw):
        self.gains: TrackGuidanceGains = gains
        self.law: SteeringLaw = law
        self.begin(NOWHERE)

    def begin(self, track: Track, *, loitering: bool = False) -> None:
        """Begin a track; `loitering` if the vehicle is on its circle already."""
        self.near: bool = False
        self.loitering: bool = loitering
        self.course: float = 0.0
        self.target: float = 0.0
        self.eta: float = 0.0
        self.update_track_coordinates(track)

    def update_track_coordinates(self, track: Track) -> None:
        """Continue along a track whose coordinates have changed."""
        self.track = track
        self._straight = track.circle_entry_track() if track.radius > 0.0 else track

    def step(self, state: imc.EstimatedState) -> float:
        """The heading to steer (rad)."""
        at, track, gains = (state.x, state.y), self.track, self.gains
        speed, course = math.hypot(state.vx, state.vy), math.atan2(state.vy, state.vx)
        if not gains.controls_course or speed < SLOWEST_COURSE:
            course = state.psi
            speed = speed if gains.controls_course else state.u
        where = progress(self._straight, at, speed, course, state.psi)
        self.where: PathProgress = where
        self.eta = where.eta(gains.arrival_time, gains.slowest)
        if not self.loitering and not self.near and self.eta <= 0.0:
            self.loitering, self.near = track.radius > 0.0, track.radius <= 0.0
        if self.loitering:
            target = self.law.circle_course(bearing(at, track.end), math.dist(at, track.end), track.radius, track.side)
        elif where.left > 0.0:
            target = self.law.line_course(where, self._straight.bearing)
        else:
            target = where.line_of_sight
        self.course, self.target = course, target
        return wrap(target + clamp_magnitude(wrap(state.psi - course), LARGEST_DRIFT))
