"""A straight track or a circle in the plane, and the progress of a vehicle on it."""

import math
from dataclasses import dataclass
from typing import NamedTuple

from support.planar_geometry import Point, along_and_across, bearing


@dataclass(frozen=True)
class Track:
    """A line from `start` to `end`, or with a `radius` (m) a circle around `end`, clockwise (`side` 1) or not (-1)."""

    start: Point
    end: Point
    radius: float = 0.0
    side: int = 1

    @property
    def bearing(self) -> float:
        """Direction from start to end (rad)."""
        return bearing(self.start, self.end)

    @property
    def length(self) -> float:
        """Distance from start to end (m)."""
        return math.dist(self.start, self.end)

    def circle_entry_track(self) -> "Track":
        """The straight track to the start of the circle: abeam of the center, which is on the inner side."""
        direction = self.bearing - self.side * 0.5 * math.pi
        north, east = self.end
        end = north + self.radius * math.cos(direction), east + self.radius * math.sin(direction)
        return Track(self.start, end)


class PathProgress(NamedTuple):
    """Position of a vehicle (m): `x` along and `y` to starboard of the track, `left` before and `range` to its end.

    `speed` (m/s) and `course` (rad) describe its motion, `vx` and `vy` (m/s) are the parts along and across the track;
    `line_of_sight` is the direction to the end and `psi` the heading (rad).
    """

    x: float
    y: float
    left: float
    range: float
    line_of_sight: float
    speed: float
    course: float
    psi: float
    vx: float
    vy: float

    def eta(self, early: float, lowest_speed: float) -> float:
        """Time to the end (s) minus `early`; a vehicle that passes the end on one side arrives when abeam of it."""
        ex, ey = abs(self.left), abs(self.y)
        speed = max(lowest_speed, self.speed)
        abeam = ex <= ey and ey < 1.75 * early * speed
        return (ex if abeam else math.hypot(ex, ey)) / speed - early


def progress(track: Track, at: Point, speed: float, course: float, psi: float) -> PathProgress:
    """Progress of a vehicle at a point on a straight track."""
    direction = track.bearing
    x, y = along_and_across(at[0] - track.start[0], at[1] - track.start[1], direction)
    drift = course - direction
    return PathProgress(
        x=x,
        y=y,
        left=track.length - x,
        range=math.dist(at, track.end),
        line_of_sight=bearing(at, track.end),
        speed=speed,
        course=course,
        psi=psi,
        vx=speed * math.cos(drift),
        vy=speed * math.sin(drift),
    )
