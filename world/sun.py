"""The sun: where it stands, and its light under water."""

import math
from dataclasses import dataclass

from support.rotations import Vector

REFRACTION = 1.34  # of sea water
BRIGHTNESS = 1e5  # lux at the surface of the sea by day
STARLIGHT = 1e-3  # lux
DUSK = math.radians(1.34)  # further down, the sun leaves a tenth of its light: 3 lux at the end of civil twilight


@dataclass(frozen=True)
class Sun:
    """Azimuth (rad from north) and elevation (rad, at most π/2; negative at night)."""

    azimuth: float = 0.0
    elevation: float = math.pi / 2

    def __post_init__(self) -> None:
        if not abs(self.elevation) <= math.pi / 2 or not math.isfinite(self.azimuth):
            raise ValueError(f"the sun has no elevation of {math.degrees(self.elevation):g}°")

    @property
    def lux(self) -> float:
        """Light at the surface: the same all day, since clouds matter more; less and less after sunset."""
        return max(STARLIGHT, BRIGHTNESS * 10.0 ** (min(0.0, self.elevation) / DUSK))

    @property
    def direction(self) -> Vector:
        """Unit vector to the sun (north, east, down); to where it went down, after that."""
        return self._vector(max(0.0, self.elevation))

    @property
    def direction_under_water(self) -> Vector:
        """Unit vector to where its light comes from under water: higher than the sun, by Snell's law."""
        return self._vector(math.acos(math.cos(max(0.0, self.elevation)) / REFRACTION))

    @property
    def path_factor_under_water(self) -> float:
        """Ratio of the way of its light under water to the depth."""
        return -1.0 / self.direction_under_water[2]

    def _vector(self, elevation: float) -> Vector:
        level = math.cos(elevation)
        return level * math.cos(self.azimuth), level * math.sin(self.azimuth), -math.sin(elevation)
