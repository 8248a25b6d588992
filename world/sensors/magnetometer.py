"""The magnetic field that a magnetometer in a vehicle measures: the Earth's, bent and added to by the vehicle."""

import math
from collections.abc import Sequence

from support.rotations import Vector, rotation

NO_SOFT_IRON = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


class Magnetometer:
    """One in the axes of the vehicle: forward, right, down.

    The Earth's field has a `strength` (G), points `declination` (rad) east of true north and `inclination` (rad) below
    the horizon. The vehicle's iron multiplies it by the matrix `soft_iron` (rows) and adds the vector `hard_iron` (G).
    """

    def __init__(
        self,
        strength: float,
        declination: float,
        inclination: float,
        hard_iron: Sequence[float] = (),
        soft_iron: Sequence[float] = (),
    ) -> None:
        level = strength * math.cos(inclination)
        self._earth = (
            level * math.cos(declination),
            level * math.sin(declination),
            strength * math.sin(inclination),
        )
        self._hard_iron = tuple(hard_iron) or (0.0, 0.0, 0.0)
        flat = tuple(soft_iron) or NO_SOFT_IRON
        self._soft_iron = flat[:3], flat[3:6], flat[6:]

    def measure(self, phi: float, theta: float, psi: float) -> Vector:
        """The field (G) at an attitude (rad)."""
        turn = rotation(phi, theta, psi)
        body = [math.fsum(turn[k][i] * self._earth[k] for k in range(3)) for i in range(3)]
        x, y, z = (
            math.fsum(factor * part for factor, part in zip(row, body, strict=True)) + added
            for row, added in zip(self._soft_iron, self._hard_iron, strict=True)
        )
        return x, y, z
