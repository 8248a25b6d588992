"""The attitude and thrust that an acceleration of a multirotor needs."""

import math

from support.planar_geometry import along_and_across
from support.rotations import Vector
from support.vectors import limit_horizontal_and_vertical

GRAVITY = 9.80665
LEAST_LIFT = 0.3 * GRAVITY  # m/s²; least upward part of the thrust


def tilt_and_thrust(acceleration: Vector, psi: float, steepest: float) -> tuple[float, float, float]:
    """Roll, pitch (rad) and specific thrust (m/s²) for an acceleration (m/s²) of a multirotor with heading `psi` (rad).

    The thrust must point along f = a - g e3. Cutting the horizontal part limits its tilt to `steepest` (rad):
    Mellinger and Kumar, Minimum Snap Trajectory Generation and Control for Quadrotors, ICRA 2011, eq. 6 to 9.
    """
    lift = max(LEAST_LIFT, GRAVITY - acceleration[2])
    reach = lift * math.tan(steepest)
    north, east, _ = limit_horizontal_and_vertical(acceleration, reach, 0.0, 0.0)
    ahead, starboard = along_and_across(north, east, psi)
    thrust = math.sqrt(ahead * ahead + starboard * starboard + lift * lift)
    return math.asin(starboard / thrust), math.atan2(-ahead, lift), thrust


def rotor_actuation(thrust: float, hover: float) -> float:
    """The actuation, 0 to 1, of rotors for a specific thrust (m/s²); `hover` is the one that carries the weight."""
    return max(0.0, min(1.0, hover * math.sqrt(max(0.0, thrust) / GRAVITY)))
