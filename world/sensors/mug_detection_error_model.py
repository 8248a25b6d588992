"""The errors of detections of gliders, by the name of their model."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from world.detection import PlaneDetection
from world.optics import FieldOfViewCamera
from world.sensors import original_mug_camera
from world.sensors.mug_detection_geometry import ACCURACY, UNIFORM_ERROR, NorthEastOffset, ground_position_sigma

if TYPE_CHECKING:
    from numpy.random import Generator


@dataclass(frozen=True)
class DetectionErrorModel:
    """`model` is None, Uniform, Frozen, GSD or Covariance; unless `is_physical`, its bound is that of the original."""

    model: str
    camera: FieldOfViewCamera
    is_physical: bool

    def draw(self, random: "Generator") -> NorthEastOffset:
        """Two random numbers, drawn also for a glider that is out of sight, so that the others' stay the same."""
        if self.model in ("GSD", "Covariance"):
            north, east = random.standard_normal(2).tolist()
        elif self.model == "Uniform":
            north, east = random.random(2).tolist()
            north, east = 2.0 * north - 1.0, 2.0 * east - 1.0
        else:
            north, east = original_mug_camera.FROZEN
        return north, east

    def apply(
        self, seen: PlaneDetection | NorthEastOffset, draws: NorthEastOffset, height: float, mug: NorthEastOffset
    ) -> NorthEastOffset:
        """A detection (m north and east) with its error, at a height (m) above a glider at `mug` (m)."""
        north, east = (seen.north, seen.east) if isinstance(seen, PlaneDetection) else seen
        if isinstance(seen, PlaneDetection) and self.model == "Covariance":
            covariance = seen.covariance(ACCURACY.pose_error_variances(height))
            (a, b, _, c) = np.linalg.cholesky(covariance).T.reshape(-1).tolist()
            return north + a * draws[0], east + b * draws[0] + c * draws[1]
        scale = self._scale(height, mug)
        return north + scale[0] * draws[0], east + scale[1] * draws[1]

    def _scale(self, height: float, mug: NorthEastOffset) -> NorthEastOffset:
        """Scale (m) of the numbers that are drawn."""
        if self.model == "None":
            return 0.0, 0.0
        if self.model == "GSD":
            sigma = ground_position_sigma(self.camera, height, mug)
            return sigma, sigma
        if self.is_physical:
            return UNIFORM_ERROR * height, UNIFORM_ERROR * height
        return original_mug_camera.error_bound(self.camera, height)
