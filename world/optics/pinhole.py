"""A pinhole camera that looks straight down, with the top of its image towards the bow."""

import math
from dataclasses import dataclass

from world.attitude import Matrix, Vector, to_body, to_ned

NEAR = 1e-6  # m, closer to the camera's plane nothing is visible


def focal_length(pixels: float, field_of_view: float) -> float:
    """Focal length (px) of a side of `pixels` that spans `field_of_view` (rad)."""
    return 0.5 * pixels / math.tan(0.5 * field_of_view)


@dataclass(frozen=True, slots=True)
class Pinhole:
    """Size (px) and fields of view (rad). Pixel (i, j) covers [i, i+1) x [j, j+1) of the image."""

    width: int
    height: int
    horizontal: float
    vertical: float

    def project(self, r: Matrix, to_target: Vector) -> tuple[float, float] | None:
        """Image point (px) of a target at `to_target` (m, north-east-down, from the camera); None behind the camera.

        `r` is the vehicle's rotation from body to north-east-down. The camera's x, y, z are the body's y, -x, z.
        """
        x, y, z = to_body(r, to_target)
        if z <= NEAR:
            return None
        u = 0.5 * self.width + focal_length(self.width, self.horizontal) * y / z
        v = 0.5 * self.height - focal_length(self.height, self.vertical) * x / z
        return u, v

    def covers(self, u: float, v: float) -> bool:
        """Whether an image point lies in the image; the right and lower borders are outside."""
        return 0.0 <= u < self.width and 0.0 <= v < self.height

    def locate(self, r: Matrix, u: float, v: float, height: float) -> tuple[float, float] | None:
        """North and east (m, from the camera) where the ray of an image point meets the plane `height` m below.

        None if the ray misses the plane.
        """
        right = (u - 0.5 * self.width) / focal_length(self.width, self.horizontal)
        back = (v - 0.5 * self.height) / focal_length(self.height, self.vertical)
        north, east, down = to_ned(r, (-back, right, 1.0))
        if down * height <= 0.0:
            return None
        return north * height / down, east * height / down

    def ground_sample(self, height: float) -> float:
        """Size on the ground (m) of a pixel seen from `height` (m)."""
        return height / focal_length(self.width, self.horizontal)
