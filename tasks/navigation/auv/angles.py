"""Angles, and vectors turned between body and north-east-down."""

import math

Vector = tuple[float, float, float]


def wrap(angle: float) -> float:
    """The angle in [-pi, pi), rad."""
    return angle if -math.pi <= angle < math.pi else (angle + math.pi) % (2.0 * math.pi) - math.pi


def rotation(angles: Vector) -> tuple[Vector, Vector, Vector]:
    """Rz(psi) Ry(theta) Rx(phi) of phi, theta, psi (rad), row by row; Fossen 2011, eq. 2.18."""
    phi, theta, psi = angles
    sr, cr, sp, cp = math.sin(phi), math.cos(phi), math.sin(theta), math.cos(theta)
    sy, cy = math.sin(psi), math.cos(psi)
    return (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )


def to_ned(angles: Vector, vector: Vector) -> Vector:
    """A body vector in north-east-down, at phi, theta, psi (rad)."""
    (a, b, c), (d, e, f), (g, h, i) = rotation(angles)
    x, y, z = vector
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


def to_body(angles: Vector, vector: Vector) -> Vector:
    """A vector north-east-down in the body frame, at phi, theta, psi (rad)."""
    (a, b, c), (d, e, f), (g, h, i) = rotation(angles)
    x, y, z = vector
    return a * x + d * y + g * z, b * x + e * y + h * z, c * x + f * y + i * z
