"""A pinhole camera by its fields of view, whose pixels need not be square."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from world.optics.camera_model import Bools, Floats

NEAR = 1e-6  # m, closer to the camera's plane nothing is visible


def focal_length(pixels: float, field_of_view: float) -> float:
    """Focal length (px) of a side of `pixels` that spans `field_of_view` (rad)."""
    return 0.5 * pixels / math.tan(0.5 * field_of_view)


@dataclass(frozen=True, slots=True)
class FieldOfViewCamera:
    """Size (px) and fields of view (rad). Pixel (i, j) covers [i, i+1) x [j, j+1) of the image."""

    width: int
    height: int
    horizontal: float
    vertical: float

    @property
    def focal_lengths(self) -> tuple[float, float]:
        """Focal lengths (px) along the rows and along the columns."""
        return focal_length(self.width, self.horizontal), focal_length(self.height, self.vertical)

    def project(self, x: float, y: float, z: float) -> tuple[float, float] | None:
        """Image point (px) of a point of the optical frame (x right, y down, z ahead; m); None behind the camera."""
        if z <= NEAR:
            return None
        across, down = self.focal_lengths
        return 0.5 * self.width + across * x / z, 0.5 * self.height + down * y / z

    def is_in_image(self, u: float, v: float) -> bool:
        """Whether an image point lies in the image; the right and lower borders are outside."""
        return 0.0 <= u < self.width and 0.0 <= v < self.height

    def unproject(self, pixels: ArrayLike) -> tuple[Floats, Bools]:
        """Rays (..., 3) through pixels (..., 2), with z = 1, and that they exist."""
        places = np.asarray(pixels, np.float64) - (0.5 * self.width, 0.5 * self.height)
        ahead = np.ones((*places.shape[:-1], 1))
        rays = np.concatenate((places / self.focal_lengths, ahead), axis=-1)
        return rays, np.ones(rays.shape[:-1], np.bool_)

    def ground_sample_distance(self, height: float) -> float:
        """Size on the ground (m) of a pixel seen from `height` (m)."""
        return height / focal_length(self.width, self.horizontal)
