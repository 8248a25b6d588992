"""A pinhole camera whose lens distorts as Brown and Conrady describe, like OpenCV's and Kalibr's radtan."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from world.optics.camera_model import Bools, CameraModel, Floats
from world.optics.plane_inversion import (
    WIDEST,
    Slope,
    distortion_jacobian,
    fold_angle,
    invert_distortion,
    points_before_lens,
)

FIT_POINTS = 40  # across a picture


@dataclass(frozen=True)
class PinholeModel(CameraModel):
    """Radial coefficients k1 to k3, tangential p1 and p2 (Brown 1971; the same as in OpenCV)."""

    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0

    @cached_property
    def _edge(self) -> float:
        """The squared radius before the lens from which on the picture would fold back (1)."""
        # d(r (1 + k1 r² + k2 r⁴ + k3 r⁶))/dr, as a polynomial of r²
        roots = np.roots([7.0 * self.k3, 5.0 * self.k2, 3.0 * self.k1, 1.0])
        folds = [float(root.real) for root in roots if abs(root.imag) < 1e-9 and root.real > 0.0]
        return min([*folds, WIDEST**2])

    @property
    def fold_angle(self) -> float | None:
        """The angle (rad) off the axis from which on the picture would fold back; None if it does not."""
        return fold_angle(self._edge)

    def project_to_unit_plane(self, points: Floats) -> tuple[Floats, Bools]:
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            x, y, valid = points_before_lens(points, self._edge)
            return self._bent(x, y), valid

    def unproject_from_unit_plane(self, places: Floats) -> tuple[Floats, Bools]:
        """Invert by Newton's method, from the place itself, drawn in to where the lens does not fold."""
        within = 0.95 * np.sqrt(self._edge) / np.maximum(np.linalg.norm(places, axis=-1, keepdims=True), 1e-300)
        return invert_distortion(self._bent, self._slope, places, places * np.minimum(1.0, within), self._edge)

    def unit_plane_jacobian(self, points: Floats) -> Floats:
        return distortion_jacobian(self._slope, points)

    def to_opencv(self) -> dict[str, Any]:
        return {
            "model": "pinhole",
            "K": self.intrinsic_matrix,
            "D": np.array([self.k1, self.k2, self.p1, self.p2, self.k3]),
        }

    def to_kalibr(self) -> dict[str, Any]:
        if not self.k3:
            return self.kalibr_entry("pinhole", [], "radtan", [self.k1, self.k2, self.p1, self.p2])
        near, rms = fit_radtan(self)
        return {**near.to_kalibr(), "fit_rms_px": rms}

    def _bent(self, x: Floats, y: Floats) -> Floats:
        """Places (..., 2) after the lens of those before it."""
        r2 = x * x + y * y
        radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))
        return np.stack(
            (
                x * radial + 2.0 * self.p1 * x * y + self.p2 * (r2 + 2.0 * x * x),
                y * radial + self.p1 * (r2 + 2.0 * y * y) + 2.0 * self.p2 * x * y,
            ),
            axis=-1,
        )

    def _slope(self, x: Floats, y: Floats) -> Slope:
        r2 = x * x + y * y
        radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))
        steep = 2.0 * (self.k1 + r2 * (2.0 * self.k2 + r2 * 3.0 * self.k3))
        mixed = steep * x * y + 2.0 * self.p1 * x + 2.0 * self.p2 * y
        return (
            radial + steep * x * x + 2.0 * self.p1 * y + 6.0 * self.p2 * x,
            mixed,
            mixed,
            radial + steep * y * y + 6.0 * self.p1 * y + 2.0 * self.p2 * x,
        )


def fit_radtan(camera: CameraModel) -> tuple[PinholeModel, float]:
    """The nearest camera with k1, k2, p1 and p2 only, and how far it is off (px, rms over the picture)."""
    u, v = (np.linspace(0.5, size - 0.5, FIT_POINTS) for size in (camera.width, camera.height))
    pixels = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
    rays, valid = camera.unproject(pixels)
    rays, pixels = rays[valid], pixels[valid]
    x, y = rays[:, 0] / rays[:, 2], rays[:, 1] / rays[:, 2]
    r2, none = x * x + y * y, np.zeros_like(x)
    # u = cx + fx x + (fx k1) x r² ..., which is linear once one focal length, by which k1 to p2 count, is found.
    aspect = camera.fy / camera.fx
    across = np.stack((x, x * r2, x * r2 * r2, 2.0 * x * y, r2 + 2.0 * x * x, none + 1.0, none), axis=-1)
    down = np.stack((y, y * r2, y * r2 * r2, r2 + 2.0 * y * y, 2.0 * x * y, none, none + 1.0 / aspect), axis=-1)
    terms = np.concatenate((across, aspect * down))
    solution, *_ = np.linalg.lstsq(terms, pixels.T.ravel(), rcond=None)
    f, *rest, cx, cy = solution.tolist()
    k1, k2, p1, p2 = (term / f for term in rest)
    near = PinholeModel(camera.width, camera.height, f, aspect * f, cx, cy, k1, k2, p1, p2)
    found = near.project(rays)[0]
    apart: Floats = (found - pixels)[np.isfinite(found[:, 0])]
    return near, math.sqrt(np.square(apart).sum() / len(apart))
