"""Common parts of all camera models: rays, pixels, derivatives, and the conventions of other programs."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.floating[Any]]
Bools = NDArray[np.bool_]


class CalibrationError(ValueError):
    """A camera cannot be like this."""


@dataclass(frozen=True)
class CameraModel(ABC):
    """A camera with a picture of `width` x `height`, focal lengths `fx`, `fy` and principal point `cx`, `cy` (px).

    Its frame is optical: x to the right of the picture, y down, z along the axis. Pixel (i, j) covers [i, i+1) x
    [j, j+1): what others call the center of the first pixel, (0, 0), is (0.5, 0.5) here. The model maps rays to the
    plane of focal length 1; u = fx x + cx and v = fy y + cy are pixels. Raises CalibrationError.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    def __post_init__(self) -> None:
        if self.width < 1 or self.height < 1:
            raise CalibrationError(f"a picture of {self.width} x {self.height} px has no pixels")
        numbers = {field.name: getattr(self, field.name) for field in fields(self)}
        for name, value in numbers.items():
            if isinstance(value, float) and not math.isfinite(value):
                raise CalibrationError(f"{name} is {value}")
        if not (self.fx > 0.0 and self.fy > 0.0):
            raise CalibrationError(f"focal lengths of {self.fx:g} and {self.fy:g} px are not positive")

    @abstractmethod
    def project_to_unit_plane(self, points: Floats) -> tuple[Floats, Bools]:
        """Places (..., 2) in the plane of focal length 1 of points (..., 3), and which of them the model covers."""

    @abstractmethod
    def unproject_from_unit_plane(self, places: Floats) -> tuple[Floats, Bools]:
        """Unit rays (..., 3) through places (..., 2) of the plane of focal length 1, and which of them exist."""

    @abstractmethod
    def unit_plane_jacobian(self, points: Floats) -> Floats:
        """Derivatives (..., 2, 3) of the places by the points."""

    @property
    def fold_angle(self) -> float | None:
        """The angle (rad) off the axis from which on the picture would fold back; None if it does not."""
        return None

    def project(self, points: ArrayLike) -> tuple[Floats, Bools]:
        """Pixels (..., 2) of points (..., 3; m, or of any length), and which of them are seen in the picture.

        Those that the model does not cover are NaN.
        """
        places, valid = self.project_to_unit_plane(np.asarray(points, np.float64))
        pixels = places * (self.fx, self.fy) + (self.cx, self.cy)
        pixels[~valid] = np.nan
        with np.errstate(invalid="ignore"):
            u, v = pixels[..., 0], pixels[..., 1]
            return pixels, valid & (u >= 0.0) & (u < self.width) & (v >= 0.0) & (v < self.height)

    def unproject(self, pixels: ArrayLike) -> tuple[Floats, Bools]:
        """Unit rays (..., 3) through pixels (..., 2), also beside the picture, and which exist; others are NaN."""
        places = (np.asarray(pixels, np.float64) - (self.cx, self.cy)) / (self.fx, self.fy)
        rays, valid = self.unproject_from_unit_plane(places)
        rays[~valid] = np.nan
        return rays, valid

    def jacobian(self, points: ArrayLike) -> Floats:
        """Derivatives (..., 2, 3) of the pixels by the points, px per unit of the points."""
        return self.unit_plane_jacobian(np.asarray(points, np.float64)) * np.array([[self.fx], [self.fy]])

    @abstractmethod
    def to_opencv(self) -> dict[str, Any]:
        """`model` ("pinhole", "fisheye", "omnidir"), `K` (3, 3) and `D` for cv2, whose first pixel is at (0, 0).

        `xi` is there for "omnidir", which is in opencv-contrib, and `max_angle` (rad off the axis) if OpenCV sees less
        than the model. Raises CalibrationError if OpenCV has no such model.
        """

    @abstractmethod
    def to_kalibr(self) -> dict[str, Any]:
        """`camera_model`, `intrinsics`, `distortion_model`, `distortion_coeffs`, `resolution` of Kalibr's camchain.

        A lens that Kalibr lacks is fitted; `fit_rms_px` is then the error. Kalibr's pixels count as OpenCV's.
        """

    def pixel_rays(self) -> tuple[Floats, Bools]:
        """Unit rays (height, width, 3) through the centers of all pixels, and which exist; others are NaN."""
        return self.top_left_block_rays(self.height, self.width)

    def top_left_block_rays(self, rows: int, columns: int) -> tuple[Floats, Bools]:
        """Rays of `pixel_rays` in the first rows and columns."""
        u, v = np.meshgrid(np.arange(columns) + 0.5, np.arange(rows) + 0.5)
        return self.unproject(np.stack((u, v), axis=-1))

    @property
    def intrinsic_matrix(self) -> Floats:
        """K (3, 3), in the convention of OpenCV and Kalibr."""
        return np.array([[self.fx, 0.0, self.cx - 0.5], [0.0, self.fy, self.cy - 0.5], [0.0, 0.0, 1.0]])

    def kalibr_entry(
        self, camera: str, first: list[float], distortion: str, coefficients: list[float]
    ) -> dict[str, Any]:
        """A camera of a camchain; `first` are numbers of the model before the focal lengths."""
        return {
            "camera_model": camera,
            "intrinsics": [*first, self.fx, self.fy, self.cx - 0.5, self.cy - 0.5],
            "distortion_model": distortion,
            "distortion_coeffs": coefficients,
            "resolution": [self.width, self.height],
        }


def normalize(vectors: Floats) -> Floats:
    """Vectors (..., 3) of length 1."""
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
