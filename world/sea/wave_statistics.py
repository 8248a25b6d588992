"""The waves of a fully developed wind sea."""

import math
from dataclasses import dataclass

USUAL_WAVE_HEIGHT = 0.88  # m, "slight" (sea state 3)


@dataclass(frozen=True)
class SeaState:
    """A sea whose significant wave height is `height` m."""

    height: float = USUAL_WAVE_HEIGHT

    def __post_init__(self) -> None:
        if not 0.0 <= self.height < math.inf:
            raise ValueError(f"{self.height:g} m is not the height of waves")

    @property
    def wind_speed(self) -> float:
        """The wind (m/s) that raises it: H = 0.21 U² / g, Pierson and Moskowitz 1964."""
        return math.sqrt(self.height * 9.80665 / 0.21)

    @property
    def rms_slope(self) -> float:
        """Root mean square of the slope; Cox and Munk 1954."""
        return math.sqrt(0.003 + 0.00512 * self.wind_speed)

    @property
    def roughness(self) -> float:
        """Slope, relative to that of a sea of the usual height."""
        return self.rms_slope / SeaState().rms_slope
