"""Models of wide lenses that look at a unit sphere or an ellipsoid from off its center: Mei's, and the extended one."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from world.optics.brown_conrady import PinholeModel
from world.optics.camera_model import Bools, CalibrationError, CameraModel, Floats


@dataclass(frozen=True)
class OmnidirectionalModel(CameraModel):
    """A pinhole `xi` above the center of a unit sphere, then k1, k2, p1, p2 of Brown (Mei and Rives, ICRA 2007).

    Kalibr's omni, camodocal's MEI and OpenCV's omnidir. With `xi` = 0 it is a pinhole camera.
    """

    xi: float = 1.0
    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.xi < 0.0:
            raise CalibrationError(f"an omnidirectional camera has an xi of at least 0, not {self.xi:g}")

    def project_to_unit_plane(self, points: Floats) -> tuple[Floats, Bools]:
        z, distance = points[..., 2], np.linalg.norm(points, axis=-1)
        # Beyond the tangent from the pinhole to the sphere, the far side would be seen through the near one.
        least = -min(self.xi, 1.0 / self.xi) if self.xi else 0.0
        places, valid = self._plane.project_to_unit_plane(self._from_pinhole(points))
        return places, valid & (distance > 0.0) & (z > least * distance)

    def unproject_from_unit_plane(self, places: Floats) -> tuple[Floats, Bools]:
        """Eq. 14 of Barreto and Araujo's lifting, after the distortion is taken off."""
        rays, valid = self._plane.unproject_from_unit_plane(places)
        with np.errstate(divide="ignore", invalid="ignore"):
            bare = rays[..., :2] / rays[..., 2:]
            r2 = np.sum(bare * bare, axis=-1)
            root = 1.0 + (1.0 - self.xi * self.xi) * r2
            factor = (self.xi + np.sqrt(root)) / (1.0 + r2)
            found = np.concatenate((bare * factor[..., None], (factor - self.xi)[..., None]), axis=-1)
        return found, valid & (root >= 0.0)

    def unit_plane_jacobian(self, points: Floats) -> Floats:
        sight = self._from_pinhole(points)
        distance = np.linalg.norm(points, axis=-1, keepdims=True)
        sight_by = np.broadcast_to(np.eye(3), (*points.shape, 3)).copy()
        sight_by[..., 2, :] += self.xi * points / distance
        return self._plane.unit_plane_jacobian(sight) @ sight_by

    def to_opencv(self) -> dict[str, Any]:
        d = np.array([self.k1, self.k2, self.p1, self.p2])
        return {"model": "omnidir", "K": self.intrinsic_matrix, "D": d, "xi": self.xi}

    def to_kalibr(self) -> dict[str, Any]:
        return self.kalibr_entry("omni", [self.xi], "radtan", [self.k1, self.k2, self.p1, self.p2])

    @cached_property
    def _plane(self) -> PinholeModel:
        size = self.width, self.height, self.fx, self.fy, self.cx, self.cy
        return PinholeModel(*size, self.k1, self.k2, self.p1, self.p2)

    def _from_pinhole(self, points: Floats) -> Floats:
        """The points (..., 3), pushed along the axis as the pinhole sees them on the sphere."""
        sight = points.copy()
        sight[..., 2] += self.xi * np.linalg.norm(points, axis=-1)
        return sight


@dataclass(frozen=True)
class ExtendedUnifiedModel(CameraModel):
    """A pinhole, `alpha` (0 to 1) off the center of an ellipsoid that `beta` (over 0) widens (Khomutenko et al., 2016).

    Kalibr's eucm. `alpha` = 0 is a pinhole camera; `alpha` = 0.5 and `beta` = 1 are the stereographic projection.
    """

    alpha: float = 0.5
    beta: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (0.0 <= self.alpha <= 1.0 and self.beta > 0.0):
            raise CalibrationError(
                f"an extended unified camera has alpha in [0, 1] and a positive beta, not {self.alpha:g}, {self.beta:g}"
            )

    def project_to_unit_plane(self, points: Floats) -> tuple[Floats, Bools]:
        z, distance = points[..., 2], self._distance(points)
        under = self.alpha * distance + (1.0 - self.alpha) * z
        least = (self.alpha - 1.0) / self.alpha if self.alpha > 0.5 else -self.alpha / (1.0 - self.alpha)
        with np.errstate(divide="ignore", invalid="ignore"):
            return points[..., :2] / under[..., None], (under > 0.0) & (z > least * distance)

    def unproject_from_unit_plane(self, places: Floats) -> tuple[Floats, Bools]:
        alpha, beta = self.alpha, self.beta
        r2 = np.sum(places * places, axis=-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            root = 1.0 - (2.0 * alpha - 1.0) * beta * r2
            ahead = (1.0 - beta * alpha * alpha * r2) / (alpha * np.sqrt(root) + 1.0 - alpha)
            rays = np.concatenate((places, ahead[..., None]), axis=-1)
            return rays / np.linalg.norm(rays, axis=-1, keepdims=True), root >= 0.0

    def unit_plane_jacobian(self, points: Floats) -> Floats:
        distance = self._distance(points)
        under = self.alpha * distance + (1.0 - self.alpha) * points[..., 2]
        under_by = self.alpha * points * (self.beta, self.beta, 1.0) / distance[..., None]
        under_by[..., 2] += 1.0 - self.alpha
        direct = np.eye(2, 3) / under[..., None, None]
        return direct - points[..., :2, None] * under_by[..., None, :] / (under * under)[..., None, None]

    def to_opencv(self) -> dict[str, Any]:
        raise CalibrationError("OpenCV has no extended unified model")

    def to_kalibr(self) -> dict[str, Any]:
        return self.kalibr_entry("eucm", [self.alpha, self.beta], "none", [])

    def _distance(self, points: Floats) -> Floats:
        x, y, z = np.moveaxis(points, -1, 0)
        return np.sqrt(self.beta * (x * x + y * y) + z * z)
