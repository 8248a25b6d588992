"""Pixels become places on a plane, with the derivatives by what they depend on."""

import math

import numpy as np
import pytest

from support.pose import DOWN, Pose, euler_angles
from support.rotations import rotation
from world.detection import DetectionAccuracy, PoseOverPlane, fits_size, project_to_plane
from world.optics import DoubleSphereModel, FisheyeModel, PinholeModel, preset_lens
from world.rendering import optical_to_body_transform

CAMERAS = [
    PinholeModel(1280, 960, 800.0, 780.0, 630.0, 470.0, k1=-0.2, k2=0.05, p1=1e-3),
    FisheyeModel(512, 512, 163.0, 163.0, 256.0, 256.0, preset_lens("equidistant", math.pi)),
    DoubleSphereModel(640, 480, 250.0, 250.0, 320.0, 240.0, -0.2, 0.6),
]
MOUNTS = [DOWN, Pose(0.5, -0.2, 0.1, 0.1, -1.2, 0.4)]
STANDING = PoseOverPlane(3.0, -2.0, 7.0, (0.1, -0.15, 2.0))
EXACT = DetectionAccuracy(pixel=0.0, shape=0.0)


def seen_at(camera, mount, standing, offset):
    """The pixel of a place, m north and east of the vehicle on the plane."""
    turn = np.array(rotation(*standing.angles))
    to = np.array([*offset, standing.height]) - turn @ mount[:3, 3]
    pixel, inside = camera.project((turn @ mount[:3, :3]).T @ to)
    assert inside
    return pixel


@pytest.mark.parametrize("camera", CAMERAS, ids=lambda camera: type(camera).__name__)
@pytest.mark.parametrize("mount", MOUNTS, ids=["down", "askew"])
@pytest.mark.parametrize("offset", [(0.3, 0.2), (1.0, -0.4), (-0.3, 1.5)])
def test_the_pixel_of_a_place_leads_back_to_it(camera, mount, offset):
    pixel = seen_at(camera, optical_to_body_transform(mount), STANDING, offset)
    (seen,) = project_to_plane(camera, optical_to_body_transform(mount), STANDING, pixel, EXACT)
    assert (seen.north, seen.east) == pytest.approx(offset, abs=1e-8)
    below = math.dist((*offset, STANDING.height), (0.0, 0.0, 0.0))
    assert seen.distance == pytest.approx(below, abs=0.6)


@pytest.mark.parametrize("mount", MOUNTS, ids=["down", "askew"])
@pytest.mark.parametrize("height", [7.0, -4.0])
def test_derivatives_are_those_of_finite_differences(mount, height):
    camera, step = CAMERAS[1], 1e-5
    if height < 0.0:
        mount = mount.compose(Pose(theta=math.pi))
    standing, matrix = STANDING._replace(height=height), optical_to_body_transform(mount)
    pixel = np.array([300.0, 220.0])

    def place(standing=standing, pixel=pixel):
        (seen,) = project_to_plane(camera, matrix, standing, pixel, EXACT)
        return np.array([seen.north, seen.east])

    (seen,) = project_to_plane(camera, matrix, standing, pixel, EXACT)
    for axis in (0, 1):
        ahead = place(pixel=pixel + step * np.eye(2)[axis])
        assert (ahead - place()) / step == pytest.approx(seen.pixel_jacobian[:, axis], rel=1e-3, abs=1e-5)
    for axis in range(3):
        x, y, z = step * np.eye(3)[axis]
        small = np.array([[1.0, -z, y], [z, 1.0, -x], [-y, x, 1.0]])
        angles = euler_angles(tuple(map(tuple, np.array(rotation(*standing.angles)) @ small)))
        turned = place(standing._replace(angles=angles))
        assert (turned - place()) / step == pytest.approx(seen.error_jacobian[:, axis], rel=1e-3, abs=1e-3)
    higher = place(standing._replace(height=height + step))
    assert (higher - place()) / step == pytest.approx(seen.error_jacobian[:, 3], rel=1e-4, abs=1e-5)


def test_what_does_not_meet_the_plane_is_not_located():
    camera, mount = CAMERAS[1], optical_to_body_transform(DOWN)
    level = STANDING._replace(angles=(0.0, 0.0, 0.0))
    pixels = [(256.0, 256.0), (900.0, 256.0), (math.nan, 3.0)]
    below, beside, nowhere = project_to_plane(camera, mount, level, pixels, DetectionAccuracy())
    assert (below.north, below.east) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert (beside, nowhere) == (None, None)
    assert project_to_plane(camera, mount, level._replace(height=-2.0), (256.0, 256.0), DetectionAccuracy()) == [None]
    assert project_to_plane(camera, mount, level._replace(height=0.0), (256.0, 256.0), DetectionAccuracy()) == [None]
    assert project_to_plane(camera, mount, level._replace(height=math.nan), (256.0, 256.0), DetectionAccuracy()) == [
        None
    ]
    assert project_to_plane(camera, mount, level, np.empty((0, 2)), DetectionAccuracy()) == []


def test_covariance_of_a_level_vehicle_is_that_of_plain_trigonometry():
    """40° off the nadir: what pixels, tilt, heading and height do, one at a time."""
    camera, mount, angle, height = CAMERAS[1], optical_to_body_transform(DOWN), math.radians(40.0), 10.0
    standing = PoseOverPlane(0.0, 0.0, height, (0.0, 0.0, 0.0))
    ahead = (256.0, 256.0 - 163.0 * angle)
    none = {"pixel": 0.0, "shape": 0.0, "attitude": 0.0, "heading": 0.0, "height": 0.0, "slope": 0.0}
    distance, per_radian = height * math.tan(angle), height / math.cos(angle) ** 2
    for name, value, north, east in (
        ("pixel", 0.5, per_radian / 163.0 * 0.5, distance / (163.0 * angle) * 0.5),
        ("shape", 0.03, 0.03, 0.03),
        ("attitude", 0.01, per_radian * 0.01, height * 0.01),
        ("heading", 0.02, 0.0, distance * 0.02),
        ("height", 0.2, math.tan(angle) * 0.2, 0.0),
        ("slope", 0.02, distance * 0.02, 0.0),
    ):
        accuracy = DetectionAccuracy(**none | {name: value})
        (seen,) = project_to_plane(camera, mount, standing, ahead, accuracy)
        sigma = np.sqrt(np.diag(seen.covariance(accuracy.pose_error_variances(height))))
        assert sigma == pytest.approx([north, east], rel=1e-4, abs=1e-9), name


def test_the_size_of_a_glider():
    (near,) = project_to_plane(
        CAMERAS[1], optical_to_body_transform(DOWN), STANDING._replace(height=5.0), (256.0, 256.0), DetectionAccuracy()
    )
    (far,) = project_to_plane(
        CAMERAS[1], optical_to_body_transform(DOWN), STANDING._replace(height=20.0), (256.0, 256.0), DetectionAccuracy()
    )
    gliders = [0.8 * 0.16 * (163.0 / height) ** 2 for height in (5.0, 20.0)]
    assert [fits_size(near, pixels, 0.8, 0.16) for pixels in (gliders[0], gliders[1] / 4, 25.0 * gliders[0])] == [
        *(True, False, False)
    ]
    assert fits_size(far, gliders[1] + 4.0, 0.8, 0.16)
    assert not fits_size(far, gliders[0] * 5.0, 0.8, 0.16)
