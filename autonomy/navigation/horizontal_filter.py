"""An extended Kalman filter of horizontal position, heading and velocity."""

import math
from collections.abc import Sequence

NORTH, EAST, PSI, R, U, V, R_BIAS, PSI_BIAS, K = range(9)
SIZE = 9
STEP = 0.05  # s, the interval of the process noise
Row = list[float]


def position_distance_squared(p: Sequence[Row], dn: float, de: float, variance: float) -> float:
    """Squared Mahalanobis distance of an innovation of the position (m), at a covariance that begins with it."""
    a, b, c = p[NORTH][NORTH] + variance, p[NORTH][EAST], p[EAST][EAST] + variance
    return (c * dn * dn - 2.0 * b * dn * de + a * de * de) / (a * c - b * b)


def reset_position(x: Row, p: list[Row], north: float, east: float, variance: float) -> None:
    """Reset the position (m) and its variance (m²) in a state and a covariance that begin with it."""
    x[NORTH], x[EAST] = north, east
    for index in (NORTH, EAST):
        for row in p:
            row[index] = 0.0
        p[index] = [0.0] * len(p)
        p[index][index] = variance


class HorizontalFilter:
    """Estimates north, east (m), heading (rad), its rate (rad/s), surge, sway (m/s), biases and speed per rpm.

    `x` is the state in the order of the constants of this module, `p` its covariance. The biases are those of the
    measured rate (rad/s) and of the compass (rad); speed per rpm, K, is in m/s per rpm. Covariances are propagated with
    the Jacobians of the equations at the estimate, measurements are applied one after the other (Bar-Shalom, Li and
    Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, ch. 10.3). Plain lists give the same
    results on any machine, and nine by nine is too small for NumPy to be faster.
    """

    def __init__(self, initial: Sequence[float], process: Sequence[float], speed_per_rpm: float):
        """`initial` and `process` are the variances of the nine states, at the start and per 0.05 s."""
        self.x: Row = [0.0] * SIZE
        self.x[K] = speed_per_rpm
        self.p: list[Row] = [[variance if i == j else 0.0 for j in range(SIZE)] for i, variance in enumerate(initial)]
        self._process = [variance / STEP for variance in process]

    def predict(self, dt: float, phi: float, theta: float, w: float) -> None:
        """Advance by `dt` s, with the roll, pitch (rad) and heave (m/s) of the vehicle."""
        x, half = self.x, 0.5 * dt
        psi = x[PSI] + half * x[R]
        cr, sr, cp, sp = math.cos(phi), math.sin(phi), math.cos(theta), math.sin(theta)
        cy, sy = math.cos(psi), math.sin(psi)
        across = sp * sr
        nu, nv, eu, ev = dt * cy * cp, dt * (cy * across - sy * cr), dt * sy * cp, dt * (sy * across + cy * cr)
        north = nu * x[U] + nv * x[V] + dt * (cy * sp * cr + sy * sr) * w
        east = eu * x[U] + ev * x[V] + dt * (sy * sp * cr - cy * sr) * w
        x[NORTH] += north
        x[EAST] += east
        x[PSI] += dt * x[R]
        # P becomes F P F' + Q. F is the identity, with these derivatives beside the diagonal:
        #   north: -east by psi, -east dt/2 by r, nu by u, nv by v
        #   east:  north by psi, north dt/2 by r, eu by u, ev by v
        #   psi:   dt by r
        # First the three changed rows of F P, then the same three columns; the others stay.
        p = self.p
        psis, rates, us, vs = p[PSI], p[R], p[U], p[V]
        rows = p[:]
        rows[NORTH] = [
            a - east * (b + half * c) + nu * d + nv * e
            for a, b, c, d, e in zip(p[NORTH], psis, rates, us, vs, strict=True)
        ]
        rows[EAST] = [
            a + north * (b + half * c) + eu * d + ev * e
            for a, b, c, d, e in zip(p[EAST], psis, rates, us, vs, strict=True)
        ]
        rows[PSI] = [a + dt * b for a, b in zip(psis, rates, strict=True)]
        for i, (n, e, a, b, u, v, c, d, k) in enumerate(rows):
            turned = a + half * b
            north_column, east_column = n - east * turned + nu * u + nv * v, e + north * turned + eu * u + ev * v
            rows[i] = [north_column, east_column, a + dt * b, b, u, v, c, d, k]
            rows[i][i] += dt * self._process[i]
        self.p = rows

    def apply_rpm_change(self, change: float) -> None:
        """Let surge follow a change of motor speed (rpm) immediately."""
        self.x[U] += change * self.x[K]
        p = self.p
        p[U] = [a + change * b for a, b in zip(p[U], p[K], strict=True)]
        for row in p:
            row[U] += change * row[K]

    def update(self, innovation: float, variance: float, *parts: tuple[int, float]) -> None:
        """Apply a measurement: its innovation, its variance, and its partial derivatives by state."""
        p = self.p
        first, factor = parts[0]
        others = parts[1:]
        ph = p[first] if factor == 1.0 else [factor * a for a in p[first]]
        for index, other in others:
            ph = [a + other * b for a, b in zip(ph, p[index], strict=True)]
        total = variance + factor * ph[first]
        for index, other in others:
            total += other * ph[index]
        if total <= 0.0:
            return
        gain = [a / total for a in ph]
        self.x = [a + innovation * g for a, g in zip(self.x, gain, strict=True)]
        # Nine by nine without inner loops takes half of the time, and this is much of a simulated vehicle's.
        b0, b1, b2, b3, b4, b5, b6, b7, b8 = ph
        self.p = [
            [
                a0 - g * b0,
                a1 - g * b1,
                a2 - g * b2,
                a3 - g * b3,
                a4 - g * b4,
                a5 - g * b5,
                a6 - g * b6,
                a7 - g * b7,
                a8 - g * b8,
            ]
            for (a0, a1, a2, a3, a4, a5, a6, a7, a8), g in zip(p, gain, strict=True)
        ]

    def state_variance(self, index: int) -> float:
        """Variance of a state."""
        found = self.p[index][index]
        return found if found > 0.0 else 0.0
