"""A camera whose lens maps the angle off its axis to a radius: quartic, or Kannala and Brandt's odd polynomial."""

import math
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from world.optics.camera_model import Bools, CalibrationError, CameraModel, Floats
from world.optics.polynomial_lens import Lens

FIT_POINTS = 2000


def kannala_brandt_lens(k: tuple[float, float, float, float], fov: float) -> Lens:
    """r = phi + k1 phi³ + k2 phi⁵ + k3 phi⁷ + k4 phi⁹ (Kannala and Brandt 2006; OpenCV's fisheye); `fov` in rad.

    Raises ValueError as Lens does.
    """
    return Lens((1.0, 0.0, k[0], 0.0, k[1], 0.0, k[2], 0.0, k[3]), fov)


@dataclass(frozen=True)
class FisheyeModel(CameraModel):
    """`lens` is for focal length 1. The picture ends where the lens does, at half of its field of view."""

    lens: Lens

    @classmethod
    def from_lens(cls, lens: Lens, size: int, scale: float = 0.0) -> Self:
        """A camera of `size` x `size` px whose axis meets the center; `scale` is px per unit of the lens' radius.

        Without it, the image circle touches the borders of the picture. Raises CalibrationError.
        """
        scale = scale or size / 2 / lens.edge_radius
        return cls(size, size, scale, scale, size / 2, size / 2, lens)

    @property
    def circle_diameter(self) -> float:
        """Diameter of the image circle, the larger one if it is an ellipse (px)."""
        return 2 * max(self.fx, self.fy) * self.lens.edge_radius

    def project_to_unit_plane(self, points: Floats) -> tuple[Floats, Bools]:
        x, y, z = np.moveaxis(points, -1, 0)
        across = np.hypot(x, y)
        phi = np.arctan2(across, z)
        valid = (phi <= self.lens.edge_angle) & ((across > 0.0) | (z > 0.0))
        radius = self.lens.radius(phi)
        factor = np.divide(radius, across, out=np.zeros_like(across), where=across > 0.0)
        return np.stack((x * factor, y * factor), axis=-1), valid

    def unproject_from_unit_plane(self, places: Floats) -> tuple[Floats, Bools]:
        radius = np.hypot(places[..., 0], places[..., 1])
        phi = self.lens.angle(radius)
        factor = np.divide(np.sin(phi), radius, out=np.zeros_like(radius), where=radius > 0.0)
        rays = np.empty((*radius.shape, 3))
        np.multiply(places[..., 0], factor, out=rays[..., 0])
        np.multiply(places[..., 1], factor, out=rays[..., 1])
        np.cos(phi, out=rays[..., 2])
        return rays, radius <= self.lens.edge_radius

    def pixel_rays(self) -> tuple[Floats, Bools]:
        if (2.0 * self.cx, 2.0 * self.cy) != (self.width, self.height):
            return super().pixel_rays()
        rows, columns = (self.height + 1) // 2, (self.width + 1) // 2
        rays, valid = np.empty((self.height, self.width, 3)), np.empty((self.height, self.width), np.bool_)
        rays[:rows, :columns], valid[:rows, :columns] = self.top_left_block_rays(rows, columns)  # and its mirror images
        for whole in (rays, valid):
            whole[:rows, columns:] = whole[:rows, : self.width - columns][:, ::-1]
            whole[rows:] = whole[: self.height - rows][::-1]
        for half in (rays[:, columns:, 0], rays[rows:, :, 1]):
            np.negative(half, out=half)
        return rays, valid

    def unit_plane_jacobian(self, points: Floats) -> Floats:
        """Derivatives of r(phi) x / rho with rho² = x² + y² and tan phi = rho / z; on the axis their limit."""
        x, y, z = np.moveaxis(points, -1, 0)
        rho2 = x * x + y * y
        rho = np.sqrt(rho2)
        phi = np.arctan2(rho, z)
        length2 = rho2 + z * z
        off_axis = rho > 1e-9 * np.abs(z)
        safe = np.where(off_axis, rho, 1.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(off_axis, self.lens.radius(phi) / safe, self.lens.radius_slope(0.0) / z)
            steep = np.where(off_axis, (self.lens.radius_slope(phi) * z / length2 - ratio) / safe**2, 0.0)
        along = -self.lens.radius_slope(phi) / length2
        rows = [
            [ratio + steep * x * x, steep * x * y, along * x],
            [steep * x * y, ratio + steep * y * y, along * y],
        ]
        return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)

    def to_opencv(self) -> dict[str, Any]:
        """Raises CalibrationError for a quartic lens: its fit is in `to_kalibr`.

        With a lens of more than 180°, `max_angle` (rad) is that off the axis up to which OpenCV is right: it mirrors
        what is behind the camera.
        """
        k = self.lens.kannala_brandt_coefficients
        if k is None:
            raise CalibrationError("OpenCV has no quartic lens; to_kalibr fits one that it has")
        found = {"model": "fisheye", "K": self.intrinsic_matrix, "D": np.array(k)}
        return {**found, "max_angle": 0.5 * math.pi} if self.lens.edge_angle > 0.5 * math.pi + 1e-9 else found

    def to_kalibr(self) -> dict[str, Any]:
        k = self.lens.kannala_brandt_coefficients
        if k is not None:
            return self.kalibr_entry("pinhole", [], "equidistant", list(k))
        near, rms = self.fit_kannala_brandt()
        return {**near.to_kalibr(), "fit_rms_px": rms}

    def fit_kannala_brandt(self) -> "tuple[FisheyeModel, float]":
        """The nearest camera with a lens of Kannala and Brandt, and how far it is off (px, rms over the angles).

        Raises ValueError if that lens folds within the field of view.
        """
        phi = np.linspace(0.0, self.lens.edge_angle, FIT_POINTS)
        powers = np.stack([phi, phi**3, phi**5, phi**7, phi**9], axis=-1)
        wanted = self.lens.radius(phi)
        found, *_ = np.linalg.lstsq(powers, wanted, rcond=None)
        focal, *rest = found.tolist()
        k = rest[0] / focal, rest[1] / focal, rest[2] / focal, rest[3] / focal
        near = replace(self, fx=self.fx * focal, fy=self.fy * focal, lens=kannala_brandt_lens(k, self.lens.fov))
        error = (powers @ found - wanted) * math.sqrt(self.fx * self.fy)
        return near, float(np.sqrt(np.mean(error**2)))
