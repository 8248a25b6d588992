"""Vectors north, east, down as tuples, and the attitude and thrust that an acceleration needs."""

import math

Vector = tuple[float, float, float]
GRAVITY = 9.80665
LEAST_LIFT = 0.3 * GRAVITY  # m/s²; least upward part of the thrust


def add(a: Vector, b: Vector, factor: float = 1.0) -> Vector:
    """a + factor b."""
    return a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]


def dot(a: Vector, b: Vector) -> float:
    """The scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def norm(a: Vector) -> float:
    """The length."""
    return math.sqrt(dot(a, a))


def shortened(a: Vector, horizontal: float, up: float, down: float) -> Vector:
    """The vector with its horizontal part no longer than `horizontal`, and its vertical between -`up` and `down`."""
    length = math.hypot(a[0], a[1])
    share = horizontal / length if length > horizontal else 1.0
    return share * a[0], share * a[1], max(-up, min(down, a[2]))


def inclination(acceleration: Vector, psi: float, steepest: float) -> tuple[float, float, float]:
    """Roll, pitch (rad) and specific thrust (m/s²) for an acceleration (m/s²) of a multirotor with heading `psi` (rad).

    The thrust must point along f = a - g e3. Cutting the horizontal part limits its tilt to `steepest` (rad):
    Mellinger and Kumar, Minimum Snap Trajectory Generation and Control for Quadrotors, ICRA 2011, eq. 6 to 9.
    """
    lift = max(LEAST_LIFT, GRAVITY - acceleration[2])
    reach = lift * math.tan(steepest)
    north, east, _ = shortened(acceleration, reach, 0.0, 0.0)
    ahead, starboard = north * math.cos(psi) + east * math.sin(psi), east * math.cos(psi) - north * math.sin(psi)
    thrust = math.sqrt(ahead * ahead + starboard * starboard + lift * lift)
    return math.asin(starboard / thrust), math.atan2(-ahead, lift), thrust
