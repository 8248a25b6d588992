"""The magnetic field that a magnetometer in a vehicle measures: the Earth's, bent and added to by the vehicle."""

import math
from collections.abc import Sequence

from support.rotations import Matrix, Vector, rotation, to_body, to_ned

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
        self._earth: Vector = (
            level * math.cos(declination),
            level * math.sin(declination),
            strength * math.sin(inclination),
        )
        x, y, z = hard_iron or (0.0, 0.0, 0.0)
        self._hard_iron: Vector = x, y, z
        a, b, c, d, e, f, g, h, i = soft_iron or NO_SOFT_IRON
        self._soft_iron: Matrix = (a, b, c), (d, e, f), (g, h, i)

    def measure(self, phi: float, theta: float, psi: float) -> Vector:
        """The field (G) at an attitude (rad)."""
        x, y, z = to_ned(self._soft_iron, to_body(rotation(phi, theta, psi), self._earth))
        a, b, c = self._hard_iron
        return x + a, y + b, z + c
