"""A Kalman filter of position, velocity and accelerometer bias along axes that are measured equally well."""

import math
from collections.abc import Sequence


class InertialFilter:
    """Driven by accelerations, corrected by positions; each axis has p' = v, v' = a - b + noise, b' = noise.

    The axes share one covariance, since they are measured together and equally well. `noise` is the density
    of the acceleration's noise (m/s²/√Hz), `walk` that of the bias (m/s³/√Hz), `variances` are those of position,
    velocity and bias at the start. Brown & Hwang, Introduction to Random Signals and Applied Kalman Filtering, ch. 5.
    """

    def __init__(self, axes: int, noise: float, walk: float, variances: tuple[float, float, float]):
        self.position: list[float] = [0.0] * axes
        self.velocity: list[float] = [0.0] * axes
        self.bias: list[float] = [0.0] * axes
        self._noise = noise * noise
        self._walk = walk * walk
        self._initial = variances
        self._p = (variances[0], 0.0, 0.0, variances[1], 0.0, variances[2])  # pp, pv, pb, vv, vb, bb

    @property
    def variances(self) -> tuple[float, float, float]:
        """Variances of position (m²), velocity (m²/s²) and bias (m²/s⁴) of each axis."""
        return self._p[0], self._p[3], self._p[5]

    def predict(self, dt: float, accelerations: Sequence[float], noise: float | None = None) -> None:
        """Advance by `dt` (s) with the mean accelerations (m/s²) of that time; `noise` replaces the usual one."""
        position, velocity, bias = self.position, self.velocity, self.bias
        for axis, measured in enumerate(accelerations):
            a, speed = measured - bias[axis], velocity[axis]
            position[axis] += dt * (speed + 0.5 * dt * a)
            velocity[axis] = speed + dt * a
        pp, pv, pb, vv, vb, bb = self._p
        half = 0.5 * dt * dt
        q = (self._noise if noise is None else noise * noise) * dt
        pp_, pb_ = pp + dt * pv - half * pb, pb + dt * vb - half * bb
        pv_, vb_ = pv + dt * vv - half * vb, vb - dt * bb
        self._p = (
            pp_ + dt * pv_ - half * pb_ + q * dt * dt / 3.0,
            pv_ - dt * pb_ + 0.5 * q * dt,
            pb_,
            vv - dt * vb - dt * vb_ + q,
            vb_,
            bb + self._walk * dt,
        )

    def mahalanobis_squared(self, positions: Sequence[float], variance: float) -> float:
        """The squared Mahalanobis distance of measured positions with a variance (m²) of each axis."""
        total = math.fsum((measured - known) ** 2 for measured, known in zip(positions, self.position, strict=True))
        return total / (self._p[0] + variance)

    def correct(self, positions: Sequence[float], variance: float) -> None:
        """Correct with measured positions (m) and the variance (m²) of each axis."""
        pp, pv, pb, vv, vb, bb = self._p
        s = 1.0 / (pp + variance)
        kp, kv, kb = pp * s, pv * s, pb * s
        position, velocity, bias = self.position, self.velocity, self.bias
        for axis, measured in enumerate(positions):
            innovation = measured - position[axis]
            position[axis] += kp * innovation
            velocity[axis] += kv * innovation
            bias[axis] += kb * innovation
        self._p = pp - kp * pp, pv - kp * pv, pb - kp * pb, vv - kv * pv, vb - kv * pb, bb - kb * pb

    def reset(self, positions: Sequence[float], variance: float, velocity_variance: float | None = None) -> None:
        """Reset to positions (m) of a variance (m²), with biases as uncertain as at the start.

        So are velocities without a variance (m²/s²) of their own.
        """
        self.position = list(positions)
        speed = self._initial[1] if velocity_variance is None else velocity_variance
        self._p = (variance, 0.0, 0.0, speed, 0.0, self._initial[2])
