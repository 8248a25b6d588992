"""Intersection of the ray of a pixel with a level plane, seen from a vehicle, and its error by errors of the pose."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from support.rotations import Vector, rotation

Floats = NDArray[np.floating[Any]]
Bools = NDArray[np.bool_]

AROUND: Floats = np.array([[0.0, 0.0], [0.5, 0.0], [-0.5, 0.0], [0.0, 0.5], [0.0, -0.5]])  # px
SMALLEST, LARGEST = 0.15, 4.0  # of the area of a body: of what is seen of it, and with its shadow
SMEARED = 2.0  # px that a body seems to be larger
TURN, HEIGHT, PLACE = slice(0, 3), 3, slice(4, 6)  # of the errors of a pose
ERRORS = 6


class RayModel(Protocol):
    """Interface of a camera model: rays (..., 3) of any length through pixels (..., 2), and which exist."""

    def unproject(self, pixels: ArrayLike) -> tuple[Floats, Bools]: ...


class PoseOverPlane(NamedTuple):
    """A vehicle at a moment: m north and east of the world's origin, Euler angles (rad), and `height`.

    `height` (m) is that of the vehicle above the plane, negative below it.
    """

    north: float
    east: float
    height: float
    angles: Vector


@dataclass(frozen=True)
class DetectionAccuracy:
    """Standard deviations of what a detection depends on, and how long errors of the pose last (s).

    Errors of a pose are Gauss-Markov processes: that of attitude (rad; roll and pitch), that of `heading` (rad), that
    of the height (m, and `slope` m per m of height), that of the place (m, north and east each). `pixel` (px) and
    `shape` (m, how far the middle of what is seen is off) are new in each picture.
    """

    pixel: float = 0.5
    shape: float = 0.02
    attitude: float = math.radians(0.3)
    heading: float = math.radians(0.5)
    height: float = 0.1
    slope: float = 0.01
    place: float = 0.3
    attitude_time: float = 5.0
    height_time: float = 10.0
    place_time: float = 60.0

    def pose_error_variances(self, height: float) -> Floats:
        """(6,) of the errors: turns about the body's axes (rad²), height (m²), north and east (m²)."""
        up = math.hypot(self.height, self.slope * height)
        sigmas = self.attitude, self.attitude, self.heading, up, self.place, self.place
        return np.square(sigmas)

    def error_decay(self, seconds: float) -> Floats:
        """(6,) the share of the errors that is left after some seconds."""
        attitude, height, place = self.attitude_time, self.height_time, self.place_time
        times = attitude, attitude, attitude, height, place, place
        return np.array([math.exp(-seconds / time) if time > 0.0 else 0.0 for time in times])


class PlaneDetection(NamedTuple):
    """An object on the plane: m north and east of the vehicle, with the covariance `noise` (2, 2) of pixel and shape.

    `error_jacobian` (2, 6) are the derivatives by the errors of the pose, `pixel_jacobian` (2, 2) those by the pixel
    (m/px). `distance` (m) is that from the camera.
    """

    north: float
    east: float
    noise: Floats
    error_jacobian: Floats
    pixel_jacobian: Floats
    distance: float

    def covariance(self, errors: Floats) -> Floats:
        """(2, 2), with `errors` (6,) as the variances of the errors of the pose; the place of the vehicle left out."""
        own = self.error_jacobian[:, :4]
        return self.noise + own * errors[:4] @ own.T


def project_to_plane(
    optics: RayModel, mount: Floats, standing: PoseOverPlane, pixels: ArrayLike, accuracy: DetectionAccuracy
) -> list[PlaneDetection | None]:
    """Project pixels (n, 2) of a camera to the plane, from the estimated pose of the vehicle; None beside the plane.

    `mount` (4, 4) leads from the optical frame to the body.
    """
    body, lever, directions, valid = _looks(optics, mount, standing, pixels)
    around = directions[:, 1::2] - directions[:, 2::2]  # from one pixel to the next, along both axes of the picture
    found: list[PlaneDetection | None] = [None] * len(directions)
    for k in np.flatnonzero(valid.all(axis=1)).tolist():
        direction = directions[k, 0]
        foot = _foot(direction, lever, standing.height)
        if foot is None:
            continue
        along, slope, offset = foot
        per_pixel = along * _on_plane(around[k].T, slope)
        by_errors = np.zeros((2, ERRORS))
        by_errors[:, TURN] = _on_plane(-body @ _cross(body.T @ offset), slope)
        by_errors[:, HEIGHT] = slope
        by_errors[:, PLACE] = np.eye(2)
        noise = accuracy.pixel**2 * per_pixel @ per_pixel.T + accuracy.shape**2 * np.eye(2)
        distance = along * float(np.linalg.norm(direction))
        found[k] = PlaneDetection(float(offset[0]), float(offset[1]), noise, by_errors, per_pixel, distance)
    return found


def point_on_plane(
    optics: RayModel, mount: Floats, standing: PoseOverPlane, pixel: tuple[float, float]
) -> tuple[float, float] | None:
    """North and east (m) of what `project_to_plane` sees at a pixel, to the last bit, without the errors."""
    _, lever, directions, valid = _looks(optics, mount, standing, pixel)
    foot = _foot(directions[0, 0], lever, standing.height) if valid.all() else None
    if foot is None:
        return None
    north, east, _ = foot[2].tolist()
    return north, east


def _looks(
    optics: RayModel, mount: Floats, standing: PoseOverPlane, pixels: ArrayLike
) -> tuple[Floats, Floats, Floats, NDArray[np.bool_]]:
    """The attitude (3, 3), the place of the camera (3,), the rays at and around pixels (n, 5, 3), which are valid."""
    points = np.asarray(pixels, np.float64).reshape(-1, 2)
    body = np.array(rotation(*standing.angles))
    turn, lever = body @ mount[:3, :3], body @ mount[:3, 3]
    rays, valid = optics.unproject(points[:, None] + AROUND)
    return body, lever, rays @ turn.T, valid


def _foot(direction: Floats, lever: Floats, height: float) -> tuple[float, Floats, Floats] | None:
    """Intersection of a ray and the plane: along the ray, m aside per m down (2,), and from the vehicle (3,)."""
    below = height - lever[2]
    if not direction[2] * below > 0.0:
        return None
    along, slope = below / direction[2], direction[:2] / direction[2]
    return along, slope, lever + along * direction


def fits_size(sighting: PlaneDetection, pixels: float, length: float, diameter: float) -> bool:
    """Whether something seen on so many pixels can be a body of a length and a diameter (m)."""
    area = abs(float(np.linalg.det(sighting.pixel_jacobian))) * pixels
    rim = SMEARED * math.sqrt(abs(float(np.linalg.det(sighting.pixel_jacobian))))
    return SMALLEST * length * diameter <= area <= LARGEST * (length + rim) * (diameter + rim)


def _on_plane(moved: Floats, slope: Floats) -> Floats:
    """(2, n) how a point of the plane moves if its ray there moves by (3, n): what is down moves it aside."""
    return moved[:2] - slope[:, None] * moved[2]


def _cross(vector: Floats) -> Floats:
    """The matrix (3, 3) of the vector product with a vector."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
