"""The model of a detection: from north-east-down to a pixel and back, and the size of its error."""

import math
from typing import NamedTuple

import numpy as np

from support.rotations import rotation, to_body, to_ned
from world.detection import Accuracy, Floats, Sighting, Standing, sight, spot_at
from world.optics import Pinhole
from world.sensors import mug_reference

Offset = tuple[float, float]

UNIFORM_ERROR = 0.05  # share of the height: half a meter at 10 m, at any resolution
PIXEL_ERROR = 0.5  # px
ATTITUDE_ERROR = math.radians(0.2)
HEIGHT_ERROR = 0.01  # share of the height
ACCURACY = Accuracy(PIXEL_ERROR, 0.0, ATTITUDE_ERROR, ATTITUDE_ERROR, 0.0, HEIGHT_ERROR, 0.0)
LOOKING_DOWN: Floats = np.array(
    [[0.0, -1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
)  # optical frame to body: the top of the picture towards the bow


class CameraPose(NamedTuple):
    """Attitude of the vehicle (rad), and its height (m) above the plane of the targets."""

    phi: float
    theta: float
    psi: float
    height: float

    @property
    def standing(self) -> Standing:
        return Standing(0.0, 0.0, self.height, (self.phi, self.theta, self.psi))


def to_camera(view: CameraPose, target: Offset, mount: Floats = LOOKING_DOWN) -> tuple[float, float, float]:
    """Where a `target` (m, from the vehicle) is in the optical frame (m); `mount` (4, 4) leads from it to the body."""
    (a, b, c, forward), (d, e, f, right), (g, h, i, down), _ = mount.tolist()
    body = rotation(view.phi, view.theta, view.psi)
    x, y, z = to_ned(body, (forward, right, down))
    from_body = to_body(body, (target[0] - x, target[1] - y, view.height - z))
    return to_body(((a, b, c), (d, e, f), (g, h, i)), from_body)


def detect(
    camera: Pinhole,
    view: CameraPose,
    target: Offset,
    believed: CameraPose | None = None,
    mount: Floats = LOOKING_DOWN,
) -> Sighting | None:
    """What the pixel shows that shows `target`, m from the vehicle; None if it is outside the image.

    `view` is where the vehicle really is, and `mount` (4, 4) where the camera is in it. Where the pixel's ray meets the
    ground is computed with the pose that the vehicle believes, so that its errors are those of the result.
    """
    pixel = _pixel(camera, view, target, mount)
    return see_pixel(camera, *pixel, believed or view, mount) if pixel is not None else None


def locate(
    camera: Pinhole, view: CameraPose, target: Offset, believed: CameraPose, mount: Floats = LOOKING_DOWN
) -> Offset | None:
    """The place (m north and east) that `detect` finds, without its errors."""
    pixel = _pixel(camera, view, target, mount)
    return spot_at(camera, mount, believed.standing, pixel) if pixel is not None else None


def _pixel(camera: Pinhole, view: CameraPose, target: Offset, mount: Floats) -> Offset | None:
    """The middle of the pixel that shows a target; None if it is outside the image."""
    point = camera.project(*to_camera(view, target, mount))
    if point is None or not camera.covers(*point):
        return None
    return math.floor(point[0]) + 0.5, math.floor(point[1]) + 0.5


def see_pixel(
    camera: Pinhole, u: float, v: float, believed: CameraPose, mount: Floats = LOOKING_DOWN
) -> Sighting | None:
    """What an image point (px) shows of the plane; None beside it."""
    (seen,) = sight(camera, mount, believed.standing, (u, v), ACCURACY)
    return seen


def detect_originally(camera: Pinhole, view: CameraPose, target: Offset) -> Offset | None:
    """Like `detect`, with the geometry of the original."""
    if not mug_reference.visible(camera, view.height, *target):
        return None
    pixel = mug_reference.to_pixel(camera, view.height, view.psi, *target)
    return mug_reference.to_offset(camera, view.height, view.psi, *pixel)


def gsd_sigma(camera: Pinhole, height: float, target: Offset) -> float:
    """Standard deviation (m) of a `target` (m, from the camera) due to pixel, attitude and height errors.

    It is infinite for a camera in the plane of the target.
    """
    if height == 0.0:
        return math.inf
    slope = math.hypot(*target) / height
    return math.hypot(
        camera.ground_sample(height) * PIXEL_ERROR,
        height * (1.0 + slope * slope) * ATTITUDE_ERROR,
        slope * height * HEIGHT_ERROR,
    )
