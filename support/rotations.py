"""Rotations between body (x forward, y right, z down) and north-east-down."""

import math
from collections.abc import Sequence
from math import cos, sin

HALF_TURN = math.pi
BACK = -math.pi
STEEPEST = 1e-3  # least cosine of the pitch: straight up or down, roll and yaw cannot be distinguished

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]
Quaternion = tuple[float, float, float, float]


def rotation(phi: float, theta: float, psi: float) -> Matrix:
    """R_nb = Rz(psi) Ry(theta) Rx(phi), as rows: rotates body vectors to north-east-down. Angles in rad.

    Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control (2011), eq. 2.18.
    """
    cr, sr, cp, sp, cy, sy = cos(phi), sin(phi), cos(theta), sin(theta), cos(psi), sin(psi)
    a, b = cy * sp, sy * sp
    return (
        (cy * cp, a * sr - sy * cr, a * cr + sy * sr),
        (sy * cp, b * sr + cy * cr, b * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )


IDENTITY: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def matrix_product(a: Matrix, b: Matrix) -> Matrix:
    """The rotation `b`, and then `a`."""
    first, second, third = ((b[0][k], b[1][k], b[2][k]) for k in range(3))
    x, y, z = to_ned(a, first), to_ned(a, second), to_ned(a, third)
    return (x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2])


def to_ned(r: Matrix, v: Vector) -> Vector:
    """Rotate a body vector to north-east-down."""
    (a, b, c), (d, e, f), (g, h, i) = r
    x, y, z = v
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


def rotate_to_ned(phi: float, theta: float, psi: float, v: Vector) -> Vector:
    """`to_ned(rotation(phi, theta, psi), v)`, quicker for a single vector."""
    cr, sr, cp, sp, cy, sy = cos(phi), sin(phi), cos(theta), sin(theta), cos(psi), sin(psi)
    a, b = cy * sp, sy * sp
    x, y, z = v
    return (
        cy * cp * x + (a * sr - sy * cr) * y + (a * cr + sy * sr) * z,
        sy * cp * x + (b * sr + cy * cr) * y + (b * cr - cy * sr) * z,
        -sp * x + cp * sr * y + cp * cr * z,
    )


def rotate_to_body(phi: float, theta: float, psi: float, v: Vector) -> Vector:
    """`to_body(rotation(phi, theta, psi), v)`, quicker for a single vector."""
    cr, sr, cp, sp, cy, sy = cos(phi), sin(phi), cos(theta), sin(theta), cos(psi), sin(psi)
    a, b = cy * sp, sy * sp
    x, y, z = v
    return (
        cy * cp * x + sy * cp * y + -sp * z,
        (a * sr - sy * cr) * x + (b * sr + cy * cr) * y + cp * sr * z,
        (a * cr + sy * sr) * x + (b * cr - cy * sr) * y + cp * cr * z,
    )


def down_axis(phi: float, theta: float) -> Vector:
    """The share of each body axis that points down: the last row of `rotation`."""
    level = cos(theta)
    return -sin(theta), level * sin(phi), level * cos(phi)


def to_body(r: Matrix, v: Vector) -> Vector:
    """Rotate a north-east-down vector to the body frame."""
    (a, b, c), (d, e, f), (g, h, i) = r
    x, y, z = v
    return a * x + d * y + g * z, b * x + e * y + h * z, c * x + f * y + i * z


def cross(a: Vector, b: Vector) -> Vector:
    """The vector product a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def body_rates(phi: float, theta: float, phi_rate: float, theta_rate: float, psi_rate: float) -> Vector:
    """p, q, r (rad/s) from the Euler angle rates (rad/s); Fossen 2011, eq. 2.28 inverted."""
    cr, sr, level = cos(phi), sin(phi), psi_rate * cos(theta)
    return phi_rate - psi_rate * sin(theta), theta_rate * cr + level * sr, level * cr - theta_rate * sr


def integrate_body_rates(angles: Vector, rates: Vector, seconds: float) -> Vector:
    """Euler angles (rad) after some moments at body rates p, q, r (rad/s); Fossen 2011, eq. 2.26, one step."""
    (phi, theta, psi), (p, q, r) = angles, rates
    cr, sr, cp = cos(phi), sin(phi), cos(theta)
    yaw = (q * sr + r * cr) / math.copysign(max(abs(cp), STEEPEST), cp)
    return (
        wrap(phi + seconds * (p + yaw * sin(theta))),
        theta + seconds * (q * cr - r * sr),
        wrap(psi + seconds * yaw),
    )


def wrap(angle: float) -> float:
    """The angle wrapped to [-pi, pi), rad."""
    return angle if BACK <= angle < HALF_TURN else (angle + math.pi) % (2.0 * math.pi) - math.pi


def quaternion_from_matrix(r: Sequence[Sequence[float]]) -> Quaternion:
    """The unit quaternion w, x, y, z of a rotation, w >= 0 (Shepperd 1978)."""
    (a, b, c), (d, e, f), (g, h, i) = r
    squares = 1.0 + a + e + i, 1.0 + a - e - i, 1.0 - a + e - i, 1.0 - a - e + i
    largest = max(range(4), key=squares.__getitem__)
    rows = (
        (squares[0], h - f, c - g, d - b),
        (h - f, squares[1], d + b, c + g),
        (c - g, d + b, squares[2], h + f),
        (d - b, c + g, h + f, squares[3]),
    )
    scale = math.copysign(2.0 * math.sqrt(squares[largest]), rows[largest][0])
    w, x, y, z = (float(part) / scale for part in rows[largest])
    return w, x, y, z


def quaternion_from_euler(phi: float, theta: float, psi: float) -> Quaternion:
    """The unit quaternion w, x, y, z of `rotation`; Fossen 2011, eq. 2.79."""
    cr, sr, cp, sp = cos(0.5 * phi), sin(0.5 * phi), cos(0.5 * theta), sin(0.5 * theta)
    cy, sy = cos(0.5 * psi), sin(0.5 * psi)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def euler_from_quaternion(quaternion: Sequence[float]) -> Vector:
    """Roll, pitch and yaw (rad) of a unit quaternion w, x, y, z that rotates body vectors to north-east-down."""
    w, x, y, z = quaternion
    return (
        math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
        math.asin(max(-1.0, min(1.0, 2.0 * (w * y - x * z)))),
        math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
    )


def matrix_from_quaternion(quaternion: Sequence[float]) -> Matrix:
    """The rotation, as rows, of a unit quaternion w, x, y, z (Hamilton)."""
    w, x, y, z = quaternion
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
