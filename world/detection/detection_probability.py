"""Probability of a detection, by the remaining contrast and the size in the image."""

import math
from dataclasses import dataclass

KOSCHMIEDER_CONSTANT = 3.912  # -ln 0.02: at the visibility, 2 % of the contrast is left (Koschmieder)
STEEPNESS = 3.0  # of the chance, per natural logarithm of contrast or size


@dataclass(frozen=True)
class DetectionProbability:
    """`maximum` is the chance of something large and near.

    At the distance of `visibility` (m) half as many are found, and of those that are as large as `least` (px). 0 stands
    for no limit.
    """

    maximum: float = 1.0
    visibility: float = 0.0
    least: float = 0.0

    def probability(self, distance: float, pixels: float) -> float:
        """The chance, 0 to 1, of something at a distance (m) that covers so many pixels."""
        found = self.maximum
        if self.visibility > 0.0:
            found *= _logistic(KOSCHMIEDER_CONSTANT * (1.0 - distance / self.visibility))
        if self.least > 0.0:
            found *= _logistic(math.log(max(pixels, 1e-9) / self.least))
        return found


def _logistic(logarithm: float) -> float:
    return 1.0 / (1.0 + math.exp(min(-STEEPNESS * logarithm, 700.0)))
