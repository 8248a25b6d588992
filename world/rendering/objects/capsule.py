"""Capsules, bodies with round ends such as gliders, and where rays from the camera meet them."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from world.optics import CameraModel, Floats

AROUND = 96  # rays across a body, and AROUND / 2 along its shorter side, that show how much of it the picture cuts off


class Capsule(NamedTuple):
    """A body in the optical frame of a camera that is outside of it.

    `center` (3,) in m from the camera, `bow` (3,) the direction of its axis, `half_length` the distance (m) from its
    center to those of its round ends, `radius` in m.
    """

    center: Floats
    bow: Floats
    half_length: float
    radius: float

    @property
    def axis_point_nearest_camera(self) -> Floats:
        """The point (3,) of its axis that is nearest to the camera."""
        aside = -float(self.center @ self.bow)
        return self.center + max(-self.half_length, min(self.half_length, aside)) * self.bow

    @property
    def ball_radius(self) -> float:
        """Radius (m) of the balls that together hold it."""
        return math.hypot(self.radius, self.half_length / self._count)

    @property
    def _count(self) -> int:
        return max(1, min(16, math.ceil(self.half_length / self.radius)))

    def covering_balls(self) -> Floats:
        """(n, 3) centers of balls of radius `ball_radius` that together hold it."""
        steps = 2.0 * np.arange(self._count + 1) / self._count - 1.0
        return self.center + (self.half_length * steps)[:, np.newaxis] * self.bow

    def ray_distances(self, rays: Floats) -> Floats:
        """Distance (n,) in m to its surface along unit rays (3, n); infinite where they miss it, or are NaN."""
        along, ahead = _dot(self.bow, rays), _dot(self.center, rays)
        aside = float(self.center @ self.bow)
        # The side: an endless cylinder of which the ray meets the nearer wall at t: sin² t² - 2 across t + off = 0.
        off = float(self.center @ self.center) - aside * aside - self.radius * self.radius
        with np.errstate(divide="ignore", invalid="ignore"):
            if off > 0.0:
                across = ahead - aside * along
                side = off / (across + np.sqrt(across * across - (1.0 - along * along) * off))
                place = side * along - aside
                # A ray that misses the cylinder is NaN here, and so are the place and the distance to an end.
                ahead = ahead + np.copysign(self.half_length, place) * along
                beyond = np.abs(place) > self.half_length
                far = (
                    float(self.center @ self.center)
                    + self.half_length**2
                    + 2.0 * self.half_length * aside * np.sign(place)
                )
            else:
                side, beyond = ahead, np.ones(ahead.shape, dtype=np.bool_)
                end = math.copysign(self.half_length, -aside)
                ahead = ahead + end * along
                far = np.array(float(self.center @ self.center) + self.half_length**2 + 2.0 * end * aside)
            off_end = far - self.radius**2
            cap = off_end / (ahead + np.sqrt(ahead * ahead - off_end))
            found = np.where(beyond, cap, side)
            return np.where(found > 0.0, found, np.inf)

    def in_image_share(self, optics: CameraModel) -> float:
        """The share, 0 to 1, of what it fills of the camera's view that lies within the picture."""
        rays = self._towards()
        rays = rays[:, np.isfinite(self.ray_distances(rays))]
        return float(np.mean(optics.project(rays.T)[1])) if rays.size else 1.0

    def _towards(self) -> Floats:
        """Unit rays (3, n), each for an equal part of a rectangle of the sphere of view that holds the body.

        By Lambert's azimuthal projection around the body: all of the body is within 90° of its nearest point.
        """
        away, size = float(np.linalg.norm(self.center)), self.half_length + self.radius
        ahead, widest = (
            (self.center / away, math.asin(size / away))
            if away > size
            else (_unit(self.axis_point_nearest_camera), 0.5 * math.pi)
        )
        across = self.bow - float(self.bow @ ahead) * ahead
        if float(np.linalg.norm(across)) < 1e-6:
            across = np.eye(3)[int(np.argmin(np.abs(ahead)))]
            across = across - float(across @ ahead) * ahead
        across = _unit(across)
        side = np.cross(ahead, across)
        length = 2.0 * math.sin(0.5 * widest)
        clear = float(np.linalg.norm(self.axis_point_nearest_camera)) - self.radius
        width = length
        if clear > 0.0:
            width = min(length, self.radius / clear / math.sqrt(1.0 - 0.25 * length * length))
        a, b = np.meshgrid(_middles(AROUND) * length, _middles(AROUND // 2) * width)
        a, b = a.ravel(), b.ravel()
        square = a * a + b * b
        within = square <= length * length
        a, b, square = a[within], b[within], square[within]
        scale = np.sqrt(1.0 - 0.25 * square)
        return ahead[:, None] * (1.0 - 0.5 * square) + across[:, None] * (a * scale) + side[:, None] * (b * scale)


def _dot(vector: Floats, field: Floats) -> Floats:
    """Dot product without a library, whose sums may depend on the number of its threads."""
    return vector[0] * field[0] + vector[1] * field[1] + vector[2] * field[2]


def _middles(count: int) -> NDArray[np.float64]:
    """The middles of `count` equal parts of -1 to 1."""
    return (2.0 * np.arange(count) + 1.0) / count - 1.0


def _unit(vector: Floats) -> Floats:
    return vector / np.linalg.norm(vector)
