"""Means of samples that come faster than they are used."""

import math

from tasks.navigation.auv.angles import Vector


class Mean:
    """The mean of vectors since it was last taken; where there is none, the last one stays. `last` is when one came."""

    def __init__(self) -> None:
        self.value: Vector = (0.0, 0.0, 0.0)
        self.last = -math.inf
        self._x = self._y = self._z = 0.0
        self._count = 0

    def add(self, time: float, x: float, y: float = 0.0, z: float = 0.0) -> None:
        """Take a sample at a time (s)."""
        self.last = time
        self._count += 1
        self._x += x
        self._y += y
        self._z += z

    def take(self) -> bool:
        """Begin anew; whether there is a new mean."""
        if not self._count:
            return False
        share = 1.0 / self._count
        self.value = share * self._x, share * self._y, share * self._z
        self._x = self._y = self._z = 0.0
        self._count = 0
        return True
