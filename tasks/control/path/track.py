"""A straight track or a circle in the plane, and where a vehicle is on it."""

import math
from dataclasses import dataclass

import imc
from tasks.control.pid import wrap

Point = tuple[float, float]  # m north, m east


@dataclass(frozen=True)
class Track:
    """From `start` to `end`; with a `radius` (m) around the centre `end`, clockwise if `side` is 1, else -1."""

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

    def tangent(self) -> "Track":
        """The straight track to where a circle begins: the end is abeam of the centre, with the centre inside."""
        direction = self.bearing - self.side * 0.5 * math.pi
        north, east = self.end
        end = north + self.radius * math.cos(direction), east + self.radius * math.sin(direction)
        return Track(self.start, end)


@dataclass(frozen=True)
class PathProgress:
    """Where a vehicle is: `x` along and `y` to starboard of the track, `left` before its end, `range` to the end (m).

    `speed` (m/s) and `course` (rad) are of its movement, `vx` and `vy` (m/s) those along and across; `line_of_sight`
    is the direction to the end and `psi` the heading (rad).
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
        """Time to the end (s) less `early`; one that passes the end sideways is there when it is abeam."""
        ex, ey = abs(self.left), abs(self.y)
        speed = max(lowest_speed, self.speed)
        abeam = ex <= ey and ey < 1.75 * early * speed
        return (ex if abeam else math.hypot(ex, ey)) / speed - early


def progress(track: Track, at: Point, speed: float, course: float, psi: float) -> PathProgress:
    """Where a vehicle at a point is on a straight track."""
    direction = track.bearing
    c, s = math.cos(direction), math.sin(direction)
    north, east = at[0] - track.start[0], at[1] - track.start[1]
    x, y = c * north + s * east, c * east - s * north
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


def bearing(origin: Point, target: Point) -> float:
    """Direction from one point to another (rad)."""
    return wrap(math.atan2(target[1] - origin[1], target[0] - origin[0]))


def is_somewhere(path: imc.DesiredPath) -> bool:
    """Whether the numbers of a path are finite, and its end is on Earth."""
    numbers = path.end_lat, path.end_lon, path.end_z, path.speed, path.lradius, path.start_lat, path.start_lon
    return all(map(math.isfinite, numbers)) and abs(path.end_lat) <= 0.5 * math.pi and abs(path.end_lon) <= math.pi
