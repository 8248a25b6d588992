"""Means of samples that arrive faster than they are used."""

import math

from world.attitude import Vector


class Mean:
    """The mean of vectors between two `take`s; without any, the last mean stays. `last` is the time of the newest."""

    def __init__(self) -> None:
        self.value: Vector = (0.0, 0.0, 0.0)
        self.last = -math.inf
        self._x = self._y = self._z = 0.0
        self._count = 0

    def add(self, time: float, x: float, y: float = 0.0, z: float = 0.0) -> None:
        """Add a sample at a time (s)."""
        self.last = time
        self._count += 1
        self._x += x
        self._y += y
        self._z += z

    def take(self) -> bool:
        """Update the mean and start the next one; False if there are no new samples."""
        if not self._count:
            return False
        share = 1.0 / self._count
        self.value = share * self._x, share * self._y, share * self._z
        self._x = self._y = self._z = 0.0
        self._count = 0
        return True
