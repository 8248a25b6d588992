"""The model of a detection: from north-east-down to a pixel and back, and the size of its error."""

import math
from typing import NamedTuple

import numpy as np

from support.rotations import rotation, to_body, to_ned
from world.detection import DetectionAccuracy, Floats, PlaneDetection, PoseOverPlane, point_on_plane, project_to_plane
from world.optics import FieldOfViewCamera
from world.sensors import original_mug_camera

NorthEastOffset = tuple[float, float]

UNIFORM_ERROR = 0.05  # share of the height: half a meter at 10 m, at any resolution
PIXEL_ERROR = 0.5  # px
ATTITUDE_ERROR = math.radians(0.2)
HEIGHT_ERROR = 0.01  # share of the height
ACCURACY = DetectionAccuracy(PIXEL_ERROR, 0.0, ATTITUDE_ERROR, ATTITUDE_ERROR, 0.0, HEIGHT_ERROR, 0.0)
LOOKING_DOWN: Floats = np.array(
    [[0.0, -1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
)  # optical frame to body: the top of the picture toward the bow


class AttitudeAndHeight(NamedTuple):
    """Attitude of the vehicle (rad), and its height (m) above the plane of the targets."""

    phi: float
    theta: float
    psi: float
    height: float

    @property
    def pose_over_plane(self) -> PoseOverPlane:
        return PoseOverPlane(0.0, 0.0, self.height, (self.phi, self.theta, self.psi))


def target_in_camera(
    view: AttitudeAndHeight, target: NorthEastOffset, mount: Floats = LOOKING_DOWN
) -> tuple[float, float, float]:
    """Position of a `target` (m, from the vehicle) in the optical frame (m); `mount` (4, 4) leads to the body."""
    (a, b, c, forward), (d, e, f, right), (g, h, i, down), _ = mount.tolist()
    body = rotation(view.phi, view.theta, view.psi)
    x, y, z = to_ned(body, (forward, right, down))
    from_body = to_body(body, (target[0] - x, target[1] - y, view.height - z))
    return to_body(((a, b, c), (d, e, f), (g, h, i)), from_body)


def detect_target(
    camera: FieldOfViewCamera,
    view: AttitudeAndHeight,
    target: NorthEastOffset,
    estimated: AttitudeAndHeight | None = None,
    mount: Floats = LOOKING_DOWN,
) -> PlaneDetection | None:
    """Detection at the pixel of `target`, m from the vehicle; None if it is outside the image.

    `view` is where the vehicle really is, and `mount` (4, 4) where the camera is in it. Where the pixel's ray meets the
    ground is computed with the pose that the vehicle estimates, so that its errors are those of the result.
    """
    pixel = _pixel(camera, view, target, mount)
    return detection_at_pixel(camera, *pixel, estimated or view, mount) if pixel is not None else None


def locate_target_on_plane(
    camera: FieldOfViewCamera,
    view: AttitudeAndHeight,
    target: NorthEastOffset,
    estimated: AttitudeAndHeight,
    mount: Floats = LOOKING_DOWN,
) -> NorthEastOffset | None:
    """The place (m north and east) that `detect_target` finds, without its errors."""
    pixel = _pixel(camera, view, target, mount)
    return point_on_plane(camera, mount, estimated.pose_over_plane, pixel) if pixel is not None else None


def _pixel(
    camera: FieldOfViewCamera, view: AttitudeAndHeight, target: NorthEastOffset, mount: Floats
) -> NorthEastOffset | None:
    """The middle of the pixel that shows a target; None if it is outside the image."""
    point = camera.project(*target_in_camera(view, target, mount))
    if point is None or not camera.is_in_image(*point):
        return None
    return math.floor(point[0]) + 0.5, math.floor(point[1]) + 0.5


def detection_at_pixel(
    camera: FieldOfViewCamera, u: float, v: float, estimated: AttitudeAndHeight, mount: Floats = LOOKING_DOWN
) -> PlaneDetection | None:
    """Point of the plane at an image point (px); None beside it."""
    (seen,) = project_to_plane(camera, mount, estimated.pose_over_plane, (u, v), ACCURACY)
    return seen


def locate_like_original_camera(
    camera: FieldOfViewCamera, view: AttitudeAndHeight, target: NorthEastOffset
) -> NorthEastOffset | None:
    """Do the same as `locate_target_on_plane`, with the geometry of the original."""
    if not original_mug_camera.is_visible(camera, view.height, *target):
        return None
    pixel = original_mug_camera.to_pixel(camera, view.height, view.psi, *target)
    return original_mug_camera.to_offset(camera, view.height, view.psi, *pixel)


def ground_position_sigma(camera: FieldOfViewCamera, height: float, target: NorthEastOffset) -> float:
    """Standard deviation (m) of a `target` (m, from the camera) due to pixel, attitude and height errors.

    It is infinite for a camera in the plane of the target.
    """
    if height == 0.0:
        return math.inf
    slope = math.hypot(*target) / height
    return math.hypot(
        camera.ground_sample_distance(height) * PIXEL_ERROR,
        height * (1.0 + slope * slope) * ATTITUDE_ERROR,
        slope * height * HEIGHT_ERROR,
    )
