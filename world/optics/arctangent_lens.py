"""The lens of Devernay and Faugeras, whose radius is an arctangent: FOV in Kalibr, ATAN in PTAM."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from world.optics.camera_model import Bools, CalibrationError, CameraModel, Floats, normalize


@dataclass(frozen=True)
class ArctangentModel(CameraModel):
    """A place at radius r before the lens is at atan(2 r tan(w / 2)) / w behind it; `w` (rad, 0 to π).

    Devernay and Faugeras, Machine Vision and Applications 2001.
    """

    w: float = 0.9

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 < self.w < math.pi:
            raise CalibrationError(f"w = {self.w:g} of a FOV lens is not within 0 and π")

    def project_to_unit_plane(self, points: Floats) -> tuple[Floats, Bools]:
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            bare = points[..., :2] / points[..., 2:]
            return bare * self._factor(bare)[..., None], points[..., 2] > 0.0

    def unproject_from_unit_plane(self, places: Floats) -> tuple[Floats, Bools]:
        radius = np.linalg.norm(places, axis=-1)
        valid = radius * self.w < 0.5 * math.pi
        safe = np.where(valid & (radius > 0.0), radius, 1.0 / self.w)
        factor = np.where(radius > 0.0, np.tan(safe * self.w) / (self._steepness * safe), self.w / self._steepness)
        return normalize(np.concatenate((places * factor[..., None], np.ones((*radius.shape, 1))), axis=-1)), valid

    def unit_plane_jacobian(self, points: Floats) -> Floats:
        z = points[..., 2]
        bare = points[..., :2] / z[..., None]
        r2 = np.sum(bare * bare, axis=-1)
        factor = self._factor(bare)
        slope = self._steepness / (self.w * (1.0 + self._steepness**2 * r2))
        near = r2 < 1e-12
        steep = np.where(near, 0.0, (slope - factor) / np.where(near, 1.0, r2))
        lens = factor[..., None, None] * np.eye(2) + steep[..., None, None] * bare[..., :, None] * bare[..., None, :]
        flat = np.concatenate((np.broadcast_to(np.eye(2), (*z.shape, 2, 2)), -bare[..., :, None]), axis=-1)
        return lens @ (flat / z[..., None, None])

    def to_opencv(self) -> dict[str, Any]:
        raise CalibrationError("OpenCV has no FOV lens")

    def to_kalibr(self) -> dict[str, Any]:
        return self.kalibr_entry("pinhole", [], "fov", [self.w])

    @property
    def _steepness(self) -> float:
        return 2.0 * math.tan(0.5 * self.w)

    def _factor(self, bare: Floats) -> Floats:
        """Distortion factor of places (..., 2) before the lens."""
        radius = np.linalg.norm(bare, axis=-1)
        safe = np.where(radius > 0.0, radius, 1.0)
        return np.where(radius > 0.0, np.arctan(self._steepness * safe) / (self.w * safe), self._steepness / self.w)
