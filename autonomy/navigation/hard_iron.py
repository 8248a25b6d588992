"""Finds the magnetic field that a vehicle adds to the Earth's, from samples while it turns."""

import math
from typing import NamedTuple

import numpy as np

LEAST_SAMPLES = 20
LARGEST_FIELD = 10.0  # G, sixteen times the Earth's: beyond what a magnetometer in a vehicle measures
LEAST_QUADRANT = 0.1  # part of the samples that each quarter of the circle needs
ROUND = 0.2  # of the radius: root mean square that the samples may be off the circle


class HardIron(NamedTuple):
    """The vehicle's own field (G) ahead and to starboard; the horizontal field of the Earth (G); the misfit (G)."""

    x: float
    y: float
    earth: float
    misfit: float


class HardIronError(ValueError):
    """The samples do not determine the vehicle's own field."""


class HardIronFit:
    """Fits a circle to the horizontal part of the magnetic field, which is a circle around the vehicle's own field.

    Source of the equations: I. Kåsa, A circle fitting procedure and its error analysis, IEEE Transactions on
    Instrumentation and Measurement 25 (1976), on samples leveled by roll and pitch. The vertical part is not
    observable in level turns and is taken as 0, as in DUNE. The sums have a constant size.
    """

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Forget all samples."""
        self.count: int = 0
        self._normal = np.zeros((3, 3))
        self._right = np.zeros(3)
        self._squares = 0.0
        self._quadrants = [0, 0, 0, 0]

    def add(self, field: tuple[float, float, float], roll: float, pitch: float, heading: float) -> None:
        """Use a sample (G, body frame) at an attitude (rad); `heading` only gives the quarter of the circle.

        What is not finite or no field at all does not count.
        """
        if not all(map(math.isfinite, (*field, roll, pitch, heading))) or math.hypot(*field) > LARGEST_FIELD:
            return
        x, y, z = field
        cr, sr, cp, sp = math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch)
        level = np.array([[cp, sp * sr], [0.0, cr]])  # of the vehicle's own field, ahead and to starboard
        p = level @ (x, y) + (sp * cr * z, -sr * z)
        row = np.array([*(2.0 * (p @ level)), 1.0])
        square = float(p @ p)
        self._normal += np.outer(row, row)
        self._right += square * row
        self._squares += square * square
        self._quadrants[int(heading % math.tau // (math.pi / 2)) % 4] += 1
        self.count += 1

    def solve(self) -> HardIron:
        """The vehicle's own field. Raises HardIronError."""
        if self.count < LEAST_SAMPLES:
            raise HardIronError(f"{self.count} samples of the magnetic field are too few")
        if min(self._quadrants) < LEAST_QUADRANT * self.count:
            raise HardIronError("the samples do not go round the circle")
        if np.linalg.cond(self._normal) > 1e12:
            raise HardIronError("the magnetic field does not change with the heading")
        x, y, offset = np.linalg.solve(self._normal, self._right)
        squared = float(offset + x * x + y * y)
        if not squared > 0.0:
            raise HardIronError("the samples are not a circle")
        # |p|² - r² is about 2 r times the distance from the circle.
        residual = self._squares - float(self._right @ (x, y, offset))
        radius = math.sqrt(squared)
        misfit = math.sqrt(max(0.0, residual) / self.count) / (2.0 * radius)
        if misfit > ROUND * radius:
            raise HardIronError(f"the samples are {misfit:.3f} G off a circle of {radius:.3f} G")
        return HardIron(float(x), float(y), radius, misfit)
