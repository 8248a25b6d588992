"""Means of samples that arrive faster than they are used."""

import math

from support.rotations import Vector


class SampleMean:
    """The mean of vectors between two calls of `update`; without any, the last mean stays. `last` is the newest's time.

    `interval_mean` is the mean over the time between two calls, by the trapezoidal rule: after a pause of the computer
    there may be only one sample, which is that of the end.
    """

    def __init__(self) -> None:
        self.value: Vector = (0.0, 0.0, 0.0)
        self.interval_mean: Vector = (0.0, 0.0, 0.0)
        self.last: float = -math.inf
        self._newest: Vector = (0.0, 0.0, 0.0)
        self._before: Vector | None = None
        self._x = self._y = self._z = 0.0
        self._count = 0

    def add(self, time: float, x: float, y: float = 0.0, z: float = 0.0) -> None:
        """Add a sample at a time (s)."""
        self.last = time
        self._count += 1
        self._x += x
        self._y += y
        self._z += z
        self._newest = x, y, z

    def update(self) -> bool:
        """Update the mean and start the next one; False if there are no new samples."""
        if not self._count:
            return False
        share = 1.0 / self._count
        self.value = share * self._x, share * self._y, share * self._z
        (x, y, z), (u, v, w), (a, b, c) = self.value, self._newest, self._before or self._newest
        share *= 0.5
        self.interval_mean = x + share * (a - u), y + share * (b - v), z + share * (c - w)
        self._before = self._newest
        self._x = self._y = self._z = 0.0
        self._count = 0
        return True
