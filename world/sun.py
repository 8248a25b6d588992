"""The sun: where it stands, and how its light goes on under water."""

import math
from dataclasses import dataclass

from world.attitude import Vector

REFRACTION = 1.34  # of sea water


@dataclass(frozen=True)
class Sun:
    """Azimuth (rad from north) and elevation (rad, above 0 and at most π/2)."""

    azimuth: float = 0.0
    elevation: float = math.pi / 2

    def __post_init__(self) -> None:
        if not 0.0 < self.elevation <= math.pi / 2:
            raise ValueError(f"a sun at an elevation of {math.degrees(self.elevation):g}° does not shine")

    @property
    def towards(self) -> Vector:
        """Unit vector to the sun (north, east, down)."""
        return self._vector(self.elevation)

    @property
    def towards_under_water(self) -> Vector:
        """Unit vector to where its light comes from under water: higher than the sun, by Snell's law."""
        return self._vector(math.acos(math.cos(self.elevation) / REFRACTION))

    @property
    def slant(self) -> float:
        """How much longer than the depth the way of its light under water is."""
        return -1.0 / self.towards_under_water[2]

    def _vector(self, elevation: float) -> Vector:
        level = math.cos(elevation)
        return level * math.cos(self.azimuth), level * math.sin(self.azimuth), -math.sin(elevation)
