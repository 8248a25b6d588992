"""Sums, products and lengths of vectors north, east, down, as tuples."""

import math

from support.rotations import Vector


def add(a: Vector, b: Vector, factor: float = 1.0) -> Vector:
    """a + factor b."""
    return a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]


def dot(a: Vector, b: Vector) -> float:
    """The scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def norm(a: Vector) -> float:
    """The length."""
    return math.sqrt(dot(a, a))


def limit_horizontal_and_vertical(a: Vector, horizontal: float, up: float, down: float) -> Vector:
    """The vector with its horizontal part no longer than `horizontal`, and its vertical between -`up` and `down`."""
    length = math.hypot(a[0], a[1])
    share = horizontal / length if length > horizontal else 1.0
    return share * a[0], share * a[1], max(-up, min(down, a[2]))
