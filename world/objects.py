"""Objects in the world: what they are, how large, and where they are at a time."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

GLIDER, CHESSBOARD, APRIL_GRID = "Glider", "Chessboard", "AprilGrid"
CLASSES = (GLIDER, CHESSBOARD, APRIL_GRID)
MOST_TAGS = 96
LENGTH, DIAMETER = 0.8, 0.16  # m, of a mini underwater glider (MUG)

NorthEast = tuple[float, float]


class Waypoint(NamedTuple):
    """Position of an object at a time (s from the start of the run): m north and east of the world's origin."""

    time: float
    north: float
    east: float


class ObjectPosition(NamedTuple):
    """Position of an object: m north and east of the world's origin, `down` m below the surface; heading in rad.

    `down` is None on a seabed of unknown depth.
    """

    north: float
    east: float
    down: float | None
    heading: float


@dataclass(frozen=True)
class WorldObject:
    """An object: its number, its class, its size (m), and its track, which has one waypoint if it lies still.

    Its middle is `depth` m below the surface, or on the seabed without a depth. It looks where it goes, or to its
    `heading` (rad). Between waypoints it moves evenly; it waits at the first one, and stays at the last. A board lies
    flat: `squares` are the rows and columns of its squares or tags, each `square_size` m wide.
    """

    id: int
    track: tuple[Waypoint, ...]
    depth: float | None = None
    heading: float | None = None
    kind: str = GLIDER
    length: float = LENGTH
    diameter: float = DIAMETER
    squares: tuple[int, int] = (6, 9)
    square_size: float = 0.05

    def __post_init__(self) -> None:
        if self.kind not in CLASSES:
            raise ValueError(f"{self.kind!r} is not one of the classes {', '.join(CLASSES)}")
        if not (0.0 < self.diameter <= self.length < math.inf):
            raise ValueError(f"{self.length:g} m by {self.diameter:g} m is not a length and a diameter")
        rows, columns = self.squares
        fewest = 2 if self.kind == CHESSBOARD else 1
        if min(rows, columns) < fewest or (self.kind == APRIL_GRID and rows * columns > MOST_TAGS):
            raise ValueError(f"{rows} x {columns} squares make no {self.kind}; there are {MOST_TAGS} tags")
        if not self.track or any(b.time <= a.time for a, b in pairwise(self.track)):
            raise ValueError("the times of a track must grow")

    def pose_at(self, time: float) -> tuple[float, float, float]:
        """North and east (m) and heading (rad) at a time (s from the start of the run)."""
        first, last = self.track[0], self.track[-1]
        if first is last:
            return first.north, first.east, self.heading or 0.0
        legs = [leg for leg in pairwise(self.track) if leg[0].time <= time] or list(pairwise(self.track))[:1]
        (begin, n, e), (end, to_n, to_e) = legs[-1]
        share = (max(first.time, min(last.time, time)) - begin) / (end - begin)
        ahead = math.atan2(to_e - e, to_n - n)
        return n + share * (to_n - n), e + share * (to_e - e), ahead if self.heading is None else self.heading


def make_gliders(places: Sequence[NorthEast], depth: float | None = None) -> tuple[WorldObject, ...]:
    """Gliders that lie still at places (m north and east), numbered from 1; on the seabed without a depth (m)."""
    return tuple(WorldObject(number, (Waypoint(0.0, *place),), depth) for number, place in enumerate(places, start=1))


def parse_positions(texts: Sequence[str]) -> tuple[NorthEast, ...]:
    """North and east (m) of each glider: a pair in each text ("1.0 0.3", "25 5"), or all numbers one by one.

    Raises ValueError if the numbers are not finite or do not come in pairs.
    """
    rows = [text.split() for text in texts]
    if all(len(row) == 1 for row in rows):
        words = [row[0] for row in rows]
        rows = [words[place : place + 2] for place in range(0, len(words), 2)]
    return tuple(_pair(row) for row in rows)


def _pair(row: list[str]) -> NorthEast:
    try:
        north, east = map(float, row)
    except ValueError:
        north = east = math.nan
    if not math.isfinite(north + east):
        raise ValueError(f"{' '.join(row)!r}: expected north and east")
    return north, east
