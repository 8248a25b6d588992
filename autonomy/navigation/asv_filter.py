"""An extended Kalman filter of the position of a boat, its velocity through the water, and the current."""

import math
from collections.abc import Sequence

from autonomy.navigation.horizontal_filter import Row, position_distance_squared, reset_position

NORTH, EAST, U, V, STREAM_NORTH, STREAM_EAST = range(6)


class ASVFilter:
    """Estimates north, east (m), surge and sway through the water and the current north and east (m/s).

    `x` is the state in the order of the constants of this module, `p` its covariance. Heading is an input.
    Surge is a random walk, sway decays with the time constant `decay` (s), the current is a slow random walk. Velocity
    that turns with the boat is its own, the rest is the current (Fossen 2011, ch. 8.3 and 11.3). Measurements are
    applied one after the other. Plain lists give the same results on any machine.
    """

    def __init__(self, position: float, speed: float, stream: float, process: Sequence[float], decay: float):
        """`position`, `speed`, `stream` are the variances at the start; `process` those added per second."""
        self.x: Row = [0.0] * 6
        initial = position, position, speed, speed, stream, stream
        self.p: list[Row] = [[variance if i == j else 0.0 for j in range(6)] for i, variance in enumerate(initial)]
        place, own, water = process
        self._process = place, place, own, own, water, water
        self._decay = decay

    def predict(self, dt: float, psi: float) -> None:
        """Advance by `dt` s at a heading (rad)."""
        nu, eu = dt * math.cos(psi), dt * math.sin(psi)
        nv, ev = -eu, nu
        keep = math.exp(-dt / self._decay)
        north, east, u, v, cn, ce = self.x
        self.x = [north + nu * u + nv * v + dt * cn, east + eu * u + ev * v + dt * ce, u, keep * v, cn, ce]
        p = self.p
        us, vs, ns, es = p[U], p[V], p[STREAM_NORTH], p[STREAM_EAST]
        rows = [
            [a + nu * b + nv * c + dt * d for a, b, c, d in zip(p[NORTH], us, vs, ns, strict=True)],
            [a + eu * b + ev * c + dt * d for a, b, c, d in zip(p[EAST], us, vs, es, strict=True)],
            us,
            [keep * a for a in vs],
            ns,
            es,
        ]
        for i, (a, b, c, d, e, f) in enumerate(rows):
            row = [a + nu * c + nv * d + dt * e, b + eu * c + ev * d + dt * f, c, keep * d, e, f]
            row[i] += dt * self._process[i]
            rows[i] = row
        self.p = rows

    def measure_position(self, north: float, east: float, variance: float) -> None:
        """Correct with a position (m) and the variance of each coordinate."""
        self._update(north - self.x[NORTH], variance, (NORTH, 1.0))
        self._update(east - self.x[EAST], variance, (EAST, 1.0))

    def measure_velocity(self, north: float, east: float, psi: float, variance: float) -> None:
        """Correct with a velocity over ground (m/s), at a heading (rad), and the variance of each coordinate."""
        c, s = math.cos(psi), math.sin(psi)
        x = self.x
        self._update(north - (c * x[U] - s * x[V] + x[STREAM_NORTH]), variance, (U, c), (V, -s), (STREAM_NORTH, 1.0))
        x = self.x
        self._update(east - (s * x[U] + c * x[V] + x[STREAM_EAST]), variance, (U, s), (V, c), (STREAM_EAST, 1.0))

    def mahalanobis_squared(self, north: float, east: float, variance: float) -> float:
        """Squared Mahalanobis distance of a position (m) from the estimate."""
        return position_distance_squared(self.p, north - self.x[NORTH], east - self.x[EAST], variance)

    def reset_position(self, north: float, east: float, variance: float) -> None:
        """Reset the position (m) and its variance (m²)."""
        reset_position(self.x, self.p, north, east, variance)

    def ground_velocity(self, psi: float) -> tuple[float, float]:
        """Surge and sway over ground (m/s) at a heading (rad)."""
        c, s = math.cos(psi), math.sin(psi)
        _, _, u, v, north, east = self.x
        return u + c * north + s * east, v + c * east - s * north

    def ground_variance(self, psi: float) -> tuple[float, float]:
        """Variances of surge and sway over ground ((m/s)²) at a heading (rad)."""
        c, s = math.cos(psi), math.sin(psi)
        ahead, aside = ((U, 1.0), (STREAM_NORTH, c), (STREAM_EAST, s)), ((V, 1.0), (STREAM_NORTH, -s), (STREAM_EAST, c))
        first, second = (
            math.fsum(f * g * self.p[i][j] for i, f in parts for j, g in parts) for parts in (ahead, aside)
        )
        return max(0.0, first), max(0.0, second)

    def _update(self, innovation: float, variance: float, *parts: tuple[int, float]) -> None:
        p = self.p
        ph = [math.fsum(factor * row[index] for index, factor in parts) for row in p]
        total = variance + math.fsum(factor * ph[index] for index, factor in parts)
        gain = [a / total for a in ph]
        self.x = [a + innovation * g for a, g in zip(self.x, gain, strict=True)]
        self.p = [[a - g * b for a, b in zip(row, ph, strict=True)] for row, g in zip(p, gain, strict=True)]
