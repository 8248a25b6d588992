"""Means of samples that arrive faster than they are used."""

import math

from support.rotations import Vector


class SampleMean:
    """The mean of vectors between two calls of `update`; without any, the last mean stays.

    `last` is the time of the newest (s).
    """

    def __init__(self) -> None:
        self.value: Vector = (0.0, 0.0, 0.0)
        self.last: float = -math.inf
        self._newest: Vector = (0.0, 0.0, 0.0)
        self._end: Vector | None = None  # the last sample of `value`
        self._begin: Vector = (0.0, 0.0, 0.0)  # the sample before its first
        self._share = 0.0  # of each sample in it
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
        self._share = share = 1.0 / self._count
        self.value = share * self._x, share * self._y, share * self._z
        self._begin, self._end = self._end or self._newest, self._newest
        self._x = self._y = self._z = 0.0
        self._count = 0
        return True

    @property
    def interval_mean(self) -> Vector:
        """The mean over the time between the last two updates that had samples, by the trapezoidal rule.

        After a pause of the computer there may be only one sample, which is that of the end.
        """
        if self._end is None:
            return self.value
        (x, y, z), (u, v, w), (a, b, c), share = self.value, self._end, self._begin, 0.5 * self._share
        return x + share * (a - u), y + share * (b - v), z + share * (c - w)
