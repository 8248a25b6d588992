"""The double sphere model of wide lenses: two unit spheres, then a pinhole."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from world.optics.camera_model import Bools, CalibrationError, CameraModel, Floats


@dataclass(frozen=True)
class DoubleSphereModel(CameraModel):
    """`xi` is the distance of the spheres, `alpha` (0 to 1) that of the pinhole (Usenko et al., 3DV 2018)."""

    xi: float = 0.0
    alpha: float = 0.5

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (0.0 <= self.alpha <= 1.0 and -1.0 < self.xi < 1.0):
            raise CalibrationError(
                f"a double sphere has alpha in [0, 1] and xi in (-1, 1), not {self.alpha}, {self.xi}"
            )

    def project_to_unit_plane(self, points: Floats) -> tuple[Floats, Bools]:
        """Eq. 40 to 45 of the article."""
        xy, z = points[..., :2], points[..., 2]
        d1, d2, below = self._distances(points)
        with np.errstate(divide="ignore", invalid="ignore"):
            places = xy / below[..., None]
        alpha, xi = self.alpha, self.xi
        w1 = alpha / (1.0 - alpha) if alpha <= 0.5 else (1.0 - alpha) / alpha
        w2 = (w1 + xi) / math.sqrt(2.0 * w1 * xi + xi * xi + 1.0)
        return places, (z > -w2 * d1) & (below > 0.0) & (d2 > 0.0)

    def unproject_from_unit_plane(self, places: Floats) -> tuple[Floats, Bools]:
        """Eq. 46 to 51 of the article."""
        alpha, xi = self.alpha, self.xi
        r2 = np.sum(places * places, axis=-1)
        valid = r2 <= (1.0 / (2.0 * alpha - 1.0) if alpha > 0.5 else math.inf)
        with np.errstate(invalid="ignore", divide="ignore"):
            mz = (1.0 - alpha * alpha * r2) / (alpha * np.sqrt(1.0 - (2.0 * alpha - 1.0) * r2) + 1.0 - alpha)
            factor = (mz * xi + np.sqrt(mz * mz + (1.0 - xi * xi) * r2)) / (mz * mz + r2)
            rays = np.concatenate((places * factor[..., None], (factor * mz - xi)[..., None]), axis=-1)
        return rays, valid

    def unit_plane_jacobian(self, points: Floats) -> Floats:
        alpha, xi = self.alpha, self.xi
        d1, d2, below = self._distances(points)
        xy, high = points[..., :2], points[..., 2] + xi * d1
        # below = alpha d2 + (1 - alpha) (xi d1 + z), with d1 = |p| and d2² = x² + y² + (z + xi d1)²
        d1_by = points / d1[..., None]
        high_by = xi * d1_by + (0.0, 0.0, 1.0)
        flat = np.concatenate((xy, np.zeros_like(xy[..., :1])), axis=-1)
        d2_by = (flat + high[..., None] * high_by) / d2[..., None]
        below_by = alpha * d2_by + (1.0 - alpha) * high_by
        direct = np.eye(2, 3) / below[..., None, None]
        return direct - xy[..., :, None] * below_by[..., None, :] / (below * below)[..., None, None]

    def to_opencv(self) -> dict[str, Any]:
        raise CalibrationError("OpenCV has no double sphere")

    def to_kalibr(self) -> dict[str, Any]:
        return self.kalibr_entry("ds", [self.xi, self.alpha], "none", [])

    def _distances(self, points: Floats) -> tuple[Floats, Floats, Floats]:
        """Distances from the centers of both spheres, and the divisor of x and y."""
        x, y, z = np.moveaxis(points, -1, 0)
        d1 = np.sqrt(x * x + y * y + z * z)
        high = z + self.xi * d1
        d2 = np.sqrt(x * x + y * y + high * high)
        return d1, d2, self.alpha * d2 + (1.0 - self.alpha) * high
