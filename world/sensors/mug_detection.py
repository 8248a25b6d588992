"""The model of a detection: from north-east-down to a pixel and back, and the size of its error."""

import math
from typing import NamedTuple

from world.attitude import UNTURNED, Matrix, product, rotation
from world.optics import Pinhole
from world.sensors import mug_original

Offset = tuple[float, float]

UNIFORM_ERROR = 0.05  # share of the height: half a meter at 10 m, at any resolution
PIXEL_ERROR = 0.5  # px
ATTITUDE_ERROR = math.radians(0.2)
HEIGHT_ERROR = 0.01  # share of the height


class CameraPose(NamedTuple):
    """Attitude of the camera (rad), and its height (m) above the plane of the targets."""

    phi: float
    theta: float
    psi: float
    height: float


def detect(
    camera: Pinhole,
    view: CameraPose,
    target: Offset,
    believed: CameraPose | None = None,
    mount: Matrix = UNTURNED,
) -> Offset | None:
    """North and east (m, from the camera) of the pixel that shows `target`; None if it is outside the image.

    `view` is where the vehicle really is, and `mount` turns a camera that looks down in it. Where the pixel's ray meets
    the ground is computed with the pose that the vehicle believes, so that its errors are those of the result.
    """
    point = camera.project(product(rotation(view.phi, view.theta, view.psi), mount), (*target, view.height))
    if point is None or not camera.covers(*point):
        return None
    pose = believed or view
    r = product(rotation(pose.phi, pose.theta, pose.psi), mount)
    return camera.locate(r, math.floor(point[0]) + 0.5, math.floor(point[1]) + 0.5, pose.height)


def detect_originally(camera: Pinhole, view: CameraPose, target: Offset) -> Offset | None:
    """Like `detect`, with the geometry of the original."""
    if not mug_original.visible(camera, view.height, *target):
        return None
    pixel = mug_original.to_pixel(camera, view.height, view.psi, *target)
    return mug_original.to_offset(camera, view.height, view.psi, *pixel)


def gsd_sigma(camera: Pinhole, height: float, target: Offset) -> float:
    """Standard deviation (m) of a `target` (m, from the camera) due to pixel, attitude and height errors."""
    slope = math.hypot(*target) / height
    return math.hypot(
        camera.ground_sample(height) * PIXEL_ERROR,
        height * (1.0 + slope * slope) * ATTITUDE_ERROR,
        slope * height * HEIGHT_ERROR,
    )
