"""A pinhole camera with OpenCV's rational lens, thin prism and tilted sensor, as OAK-D and RealSense are calibrated."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from world.optics.brown_conrady import fit_radtan
from world.optics.camera_model import Bools, CalibrationError, CameraModel, Floats
from world.optics.plane_inversion import (
    WIDEST,
    Slope,
    distortion_jacobian,
    fold_angle,
    invert_distortion,
    points_before_lens,
)

TABLE = 4096
LARGEST_MISFIT = 0.5  # px rms, of a lens that stands for this one in programs without it


@dataclass(frozen=True)
class RationalModel(CameraModel):
    """The 8, 12 and 14 coefficients of OpenCV's calib3d, in its order.

    Radial (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶), tangential p1 and p2, thin prism s1 to s4 (x: s1
    r² + s2 r⁴; y: s3 r² + s4 r⁴), and a sensor tilted by `tau_x` and `tau_y` (rad).
    """

    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    k5: float = 0.0
    k6: float = 0.0
    s1: float = 0.0
    s2: float = 0.0
    s3: float = 0.0
    s4: float = 0.0
    tau_x: float = 0.0
    tau_y: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if max(abs(self.tau_x), abs(self.tau_y)) >= 0.5 * math.pi:
            raise CalibrationError(f"a sensor tilted by {self.tau_x:g} and {self.tau_y:g} rad has no picture")

    @property
    def coefficients(self) -> tuple[float, ...]:
        """Coefficients in the order of OpenCV: 8, 12 or 14."""
        radial = self.k1, self.k2, self.p1, self.p2, self.k3, self.k4, self.k5, self.k6
        prism, tilt = (self.s1, self.s2, self.s3, self.s4), (self.tau_x, self.tau_y)
        return (*radial, *prism, *tilt) if any(tilt) else (*radial, *prism) if any(prism) else radial

    @property
    def fold_angle(self) -> float | None:
        return fold_angle(self._edge)

    def project_to_unit_plane(self, points: Floats) -> tuple[Floats, Bools]:
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            x, y, valid = points_before_lens(points, self._edge)
            places, ahead = _map(self._tilt, self._bent(x, y))
            return places, valid & (ahead > 0.0)

    def unproject_from_unit_plane(self, places: Floats) -> tuple[Floats, Bools]:
        """Invert by Newton's method, from where the radial part alone would lead."""
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            flat, ahead = _map(self._untilt, places)
            radii, bare_radii = self._table
            radius = np.linalg.norm(flat, axis=-1, keepdims=True)
            bare_radius = np.asarray(np.interp(radius, radii, bare_radii), np.float64)
            start = flat * (bare_radius / np.maximum(radius, 1e-300))
            rays, found = invert_distortion(self._bent, self._slope, flat, start, self._edge)
            return rays, found & (ahead > 0.0)

    def unit_plane_jacobian(self, points: Floats) -> Floats:
        places, ahead = _map(self._tilt, self._bent(*np.moveaxis(points[..., :2] / points[..., 2:], -1, 0)))
        tilt = (self._tilt[:2, :2] - places[..., :, None] * self._tilt[2, :2]) / ahead[..., None, None]
        return tilt @ distortion_jacobian(self._slope, points)

    def to_opencv(self) -> dict[str, Any]:
        return {"model": "pinhole", "K": self.intrinsic_matrix, "D": np.array(self.coefficients)}

    def to_kalibr(self) -> dict[str, Any]:
        """Kalibr has no rational lens: a fit. Raises CalibrationError if that is more than 0.5 px off."""
        near, rms = fit_radtan(self)
        covers_all = np.isfinite(near.project(self.pixel_rays()[0])[0]).all()
        if not (covers_all and rms <= LARGEST_MISFIT):
            raise CalibrationError(f"Kalibr has no rational lens, and the nearest radtan is {rms:.2g} px off")
        return {**near.to_kalibr(), "fit_rms_px": rms}

    @cached_property
    def _edge(self) -> float:
        """The squared radius before the lens from which on the picture would fold back, or has a pole (1)."""
        over, under = np.poly1d([self.k3, self.k2, self.k1, 1.0]), np.poly1d([self.k6, self.k5, self.k4, 1.0])
        # r N / D with q = r² grows while N D + 2 q (N' D - N D') is positive.
        growth = over * under + np.poly1d([2.0, 0.0]) * (over.deriv() * under - over * under.deriv())
        roots = [*growth.roots, *under.roots]
        ends = [float(root.real) for root in roots if abs(root.imag) < 1e-9 and root.real > 0.0]
        return min([*ends, WIDEST**2])

    @cached_property
    def _table(self) -> tuple[Floats, Floats]:
        """Radii after and before the radial part."""
        bare = np.tan(np.linspace(0.0, math.atan(math.sqrt(self._edge)), TABLE)[:-1])
        return bare * self._radial(bare * bare)[0], bare

    @cached_property
    def _tilt(self) -> Floats:
        """The projection (3, 3) onto the tilted sensor, as in OpenCV."""
        sx, cx, sy, cy = math.sin(self.tau_x), math.cos(self.tau_x), math.sin(self.tau_y), math.cos(self.tau_y)
        about_x = np.array([[1.0, 0.0, 0.0], [0.0, cx, sx], [0.0, -sx, cx]])
        about_y = np.array([[cy, 0.0, -sy], [0.0, 1.0, 0.0], [sy, 0.0, cy]])
        turned = about_y @ about_x
        along = np.array([[turned[2, 2], 0.0, -turned[0, 2]], [0.0, turned[2, 2], -turned[1, 2]], [0.0, 0.0, 1.0]])
        return along @ turned

    @cached_property
    def _untilt(self) -> Floats:
        return np.linalg.inv(self._tilt)

    def _radial(self, r2: Floats) -> tuple[Floats, Floats]:
        """The factor of the radius, and its derivative by its square."""
        over, under = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3)), self._under(r2)
        over_by = self.k1 + r2 * (2.0 * self.k2 + r2 * 3.0 * self.k3)
        under_by = self.k4 + r2 * (2.0 * self.k5 + r2 * 3.0 * self.k6)
        return over / under, (over_by * under - over * under_by) / (under * under)

    def _under(self, r2: Floats) -> Floats:
        return 1.0 + r2 * (self.k4 + r2 * (self.k5 + r2 * self.k6))

    def _bent(self, x: Floats, y: Floats) -> Floats:
        """Places (..., 2) after the lens of those before it, on a sensor without tilt."""
        r2 = x * x + y * y
        radial = self._radial(r2)[0]
        return np.stack(
            (
                x * radial + 2.0 * self.p1 * x * y + self.p2 * (r2 + 2.0 * x * x) + r2 * (self.s1 + r2 * self.s2),
                y * radial + self.p1 * (r2 + 2.0 * y * y) + 2.0 * self.p2 * x * y + r2 * (self.s3 + r2 * self.s4),
            ),
            axis=-1,
        )

    def _slope(self, x: Floats, y: Floats) -> Slope:
        r2 = x * x + y * y
        radial, by = self._radial(r2)
        steep = 2.0 * by
        mixed = steep * x * y + 2.0 * self.p1 * x + 2.0 * self.p2 * y
        across, down = 2.0 * (self.s1 + 2.0 * r2 * self.s2), 2.0 * (self.s3 + 2.0 * r2 * self.s4)
        return (
            radial + steep * x * x + 2.0 * self.p1 * y + 6.0 * self.p2 * x + across * x,
            mixed + across * y,
            mixed + down * x,
            radial + steep * y * y + 6.0 * self.p1 * y + 2.0 * self.p2 * x + down * y,
        )


def _map(matrix: Floats, places: Floats) -> tuple[Floats, Floats]:
    """Places (..., 2) under a projection (3, 3), and their distance (...) along its axis."""
    mapped = places @ matrix[:, :2].T + matrix[:, 2]
    ahead = mapped[..., 2]
    return mapped[..., :2] / ahead[..., None], ahead
