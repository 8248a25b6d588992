"""Directions and offsets in the horizontal plane: directions (rad) clockwise from north."""

import math
from collections.abc import Sequence
from itertools import pairwise

from support.rotations import wrap

Point = tuple[float, float]  # m north, m east


def bearing(origin: Point, target: Point) -> float:
    """Direction from one point to another, in [-pi, pi)."""
    return wrap(math.atan2(target[1] - origin[1], target[0] - origin[0]))


def along_and_across(north: float, east: float, direction: float) -> Point:
    """The parts of an offset or velocity in a direction, and to starboard of it."""
    c, s = math.cos(direction), math.sin(direction)
    return c * north + s * east, c * east - s * north


def north_and_east(along: float, across: float, direction: float) -> Point:
    """The offset or velocity with these parts in a direction, and to starboard of it."""
    c, s = math.cos(direction), math.sin(direction)
    return c * along - s * across, s * along + c * across


def remaining_distances(points: Sequence[Point]) -> list[float]:
    """Distance (m) from each point along the next ones to the last."""
    left = [0.0]
    for here, after in pairwise(reversed(points)):
        left.append(left[-1] + math.dist(here, after))
    return left[::-1]
