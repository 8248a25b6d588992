"""How a detection comes about: from north-east-down to a pixel and back, and the error that it gets."""

import math
from typing import NamedTuple

from world.attitude import rotation
from world.optics import Pinhole
from world.sensors import mug_original

Offset = tuple[float, float]

UNIFORM_ERROR = 0.05  # of the height: half a metre at 10 m, whatever the resolution
PIXEL_ERROR = 0.5  # px
ATTITUDE_ERROR = math.radians(0.2)
HEIGHT_ERROR = 0.01  # of the height


class CameraPose(NamedTuple):
    """From where the camera looks: attitude (rad), and the height (m) above the plane of the targets."""

    phi: float
    theta: float
    psi: float
    height: float


def detect(camera: Pinhole, view: CameraPose, target: Offset) -> Offset | None:
    """North and east (m, from the camera) that the pixel of a `target` there gives; None outside the image."""
    r = rotation(view.phi, view.theta, view.psi)
    point = camera.project(r, (*target, view.height))
    if point is None or not camera.covers(*point):
        return None
    return camera.locate(r, math.floor(point[0]) + 0.5, math.floor(point[1]) + 0.5, view.height)


def detect_originally(camera: Pinhole, view: CameraPose, target: Offset) -> Offset | None:
    """As `detect`, with the geometry of the original."""
    if not mug_original.visible(camera, view.height, *target):
        return None
    pixel = mug_original.to_pixel(camera, view.height, view.psi, *target)
    return mug_original.to_offset(camera, view.height, view.psi, *pixel)


def gsd_sigma(camera: Pinhole, height: float, target: Offset) -> float:
    """Standard deviation (m) that pixel, attitude and height errors give a `target` (m, from the camera)."""
    slope = math.hypot(*target) / height
    return math.hypot(
        camera.ground_sample(height) * PIXEL_ERROR,
        height * (1.0 + slope * slope) * ATTITUDE_ERROR,
        slope * height * HEIGHT_ERROR,
    )
