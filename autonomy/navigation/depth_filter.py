"""A Kalman filter of depth and its rate."""

import math


class DepthFilter:
    """Estimates depth (m) and sinking rate (m/s) of a vehicle whose acceleration is white noise.

    `acceleration` is the standard deviation of the vertical acceleration over a second (m/s²). `depth` counts until one
    is measured.
    """

    def __init__(self, acceleration: float, depth: float = 0.0):
        self.depth: float = depth
        self.rate: float = 0.0
        self._noise = acceleration**2
        self._p = (math.inf, 0.0, 1.0)

    @property
    def has_depth(self) -> bool:
        """Whether a depth has been measured."""
        return self._p[0] < math.inf

    @property
    def variances(self) -> tuple[float, float]:
        """Variances of depth and rate."""
        return self._p[0], self._p[2]

    def predict(self, dt: float) -> None:
        """Advance by `dt` s."""
        a, b, c = self._p
        if a == math.inf:
            return
        self.depth += dt * self.rate
        self._p = (
            a + dt * (2.0 * b + dt * c) + self._noise * dt**3 / 3.0,
            b + dt * c + 0.5 * self._noise * dt**2,
            c + self._noise * dt,
        )

    def measure_depth(self, depth: float, variance: float) -> None:
        """Correct with a measured depth (m)."""
        a, b, c = self._p
        if a == math.inf:
            self.depth = depth
            self._p = variance, 0.0, c
            return
        k, m = a / (a + variance), b / (a + variance)
        innovation = depth - self.depth
        self.depth += k * innovation
        self.rate += m * innovation
        self._p = a - k * a, b - k * b, c - m * b

    def resume(self) -> None:
        """Take the next depth as it is, and keep the rate for a first guess."""
        self._p = (math.inf, 0.0, 1.0)

    def reset(self, depth: float, variance: float) -> None:
        """Start again at a depth (m); the rate is unknown."""
        self.depth, self.rate = depth, 0.0
        self._p = variance, 0.0, 1.0

    def measure_rate(self, rate: float, variance: float) -> None:
        """Correct with a measured sinking rate (m/s)."""
        a, b, c = self._p
        k, m = b / (c + variance), c / (c + variance)
        innovation = rate - self.rate
        if a < math.inf:
            self.depth += k * innovation
        self.rate += m * innovation
        self._p = a - k * b, b - k * c, c - m * c
