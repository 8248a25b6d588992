"""Camera models keep one contract, and agree with OpenCV where it has them."""

import math

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from world.optics import (
    ArctangentModel,
    CalibrationError,
    DoubleSphereModel,
    ExtendedUnifiedModel,
    FisheyeModel,
    Lens,
    OmnidirectionalModel,
    PinholeModel,
    RationalModel,
    fit_radtan,
    kannala_brandt_lens,
    preset_lens,
)

VGA = (640, 480, 400.0, 410.0, 322.5, 238.5)
CAMERAS = {
    "pinhole": PinholeModel(*VGA),
    "euroc": PinholeModel(752, 480, 458.654, 457.296, 367.715, 248.875, -0.28340811, 0.07395907, 1.9359e-4, 1.76187e-5),
    "thick": PinholeModel(*VGA, 0.1, -0.05, 1e-3, -2e-3, 0.02),
    "equidistant": FisheyeModel(512, 512, 163.0, 163.0, 256.0, 256.0, preset_lens("equidistant", math.pi)),
    "woodscape": FisheyeModel(
        1280, 966, 339.749, 339.749, 643.942, 479.907, preset_lens("woodscape", math.radians(200.0))
    ),
    "tumvi": FisheyeModel(
        512, 512, 190.978, 190.973, 254.932, 256.897, kannala_brandt_lens((0.00348, 7.15e-4, -0.00205, 2.03e-4), 3.4)
    ),
    "double sphere": DoubleSphereModel(512, 512, 156.5, 156.5, 254.0, 257.0, -0.1977, 0.5768),
    "near pinhole": DoubleSphereModel(640, 480, 400.0, 400.0, 320.0, 240.0, 0.1, 0.2),
    "rational": RationalModel(*VGA, 1.9, 1.1, 2e-4, -1e-4, 0.05, 2.3, 1.7, 0.3),
    "prism": RationalModel(*VGA, 0.1, -0.05, 1e-3, -2e-3, 0.02, 0.05, 0.01, 0.0, 1e-3, -5e-4, 2e-3, 3e-4),
    "tilted": RationalModel(*VGA, 0.1, -0.05, 1e-3, 0.0, 0.02, 0.05, tau_x=0.02, tau_y=-0.03),
    "omni": OmnidirectionalModel(1280, 720, 1002.5, 1005.4, 638.1, 359.3, 2.04, -0.11, 0.45, -3e-4, -3e-4),
    "mei": OmnidirectionalModel(*VGA, 0.8, -0.02, 0.01, 1e-3, -2e-3),
    "eucm": ExtendedUnifiedModel(512, 512, 156.5, 157.5, 254.0, 257.0, 0.6, 1.1),
    "stereographic": ExtendedUnifiedModel(512, 512, 120.0, 120.0, 256.0, 256.0),
    "fov": ArctangentModel(*VGA, 0.93),
}
angles = st.floats(0.0, 1.0), st.floats(0.0, 2.0 * math.pi)


@pytest.fixture(params=CAMERAS)
def camera(request):
    return CAMERAS[request.param]


def ray(tilt, turn, distance=1.0):
    return distance * np.array([math.sin(tilt) * math.cos(turn), math.sin(tilt) * math.sin(turn), math.cos(tilt)])


def widest(camera):
    """An angle off the axis (rad) up to which the model is good."""
    if isinstance(camera, FisheyeModel):
        return 0.99 * camera.lens.edge_angle
    if isinstance(camera, DoubleSphereModel | OmnidirectionalModel | ExtendedUnifiedModel):
        return 1.5
    return 1.3 if isinstance(camera, ArctangentModel) else 0.75


@pytest.mark.parametrize("name", CAMERAS)
@given(share=angles[0], turn=angles[1], distance=st.floats(1e-3, 1e4))
def test_a_ray_comes_back_through_its_pixel(name, share, turn, distance):
    camera = CAMERAS[name]
    true = ray(share * widest(camera), turn)
    pixel, _ = camera.project(distance * true)
    back, found = camera.unproject(pixel)
    assert found
    assert back == pytest.approx(true, abs=1e-9)


@pytest.mark.parametrize("name", CAMERAS)
@given(share=st.floats(0.01, 0.95), turn=angles[1], distance=st.floats(0.1, 100.0))
def test_the_jacobian_is_that_of_differences(name, share, turn, distance):
    camera = CAMERAS[name]
    point = ray(share * widest(camera), turn, distance)
    step = 1e-6 * distance
    pairs = [camera.project(point + step * axis)[0] - camera.project(point - step * axis)[0] for axis in np.eye(3)]
    differences = np.stack(pairs, axis=-1) / (2.0 * step)
    found = camera.jacobian(point)
    assert found == pytest.approx(differences, rel=1e-5, abs=1e-5 * np.abs(found).max())


def test_on_the_axis_the_jacobian_is_that_of_a_pinhole(camera):
    found = camera.jacobian([0.0, 0.0, 2.0])
    pixels = camera.project([[1e-5, 0.0, 2.0], [0.0, 1e-5, 2.0], [0.0, 0.0, 2.0]])[0]
    assert found[:, 0] == pytest.approx((pixels[0] - pixels[2]) / 1e-5, rel=1e-4, abs=1e-3)
    assert found[:, 1] == pytest.approx((pixels[1] - pixels[2]) / 1e-5, rel=1e-4, abs=1e-3)
    assert found[:, 2] == pytest.approx([0.0, 0.0], abs=1e-9)


def test_many_points_at_once_are_as_one_by_one(camera):
    points = np.random.default_rng(3).normal(size=(4, 5, 3))
    pixels, seen = camera.project(points)
    for place in np.ndindex(4, 5):
        single, is_seen = camera.project(points[place])
        assert (single == pytest.approx(pixels[place], nan_ok=True), is_seen) == (True, seen[place])
    assert camera.jacobian(points).shape == (4, 5, 2, 3)
    rays, found = camera.unproject(pixels[seen])
    assert found.all()
    assert rays == pytest.approx(points[seen] / np.linalg.norm(points[seen], axis=-1, keepdims=True), abs=1e-9)


def test_what_is_behind_or_beside_the_picture_is_not_seen(camera):
    pixels, seen = camera.project([[0.0, 0.0, -1.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    assert seen.tolist() == [False, False, True]
    assert np.isnan(pixels[0]).all()
    assert pixels[2] == pytest.approx([camera.cx, camera.cy])
    beside = camera.unproject([-1.0, camera.cy])[0]
    assert not camera.project(beside)[1]


@pytest.mark.parametrize("name", ["pinhole", "euroc", "thick", "tumvi", "rational", "prism", "tilted"])
def test_opencv_sees_the_same_half_a_pixel_off(name):
    camera = CAMERAS[name]
    rng = np.random.default_rng(1)
    points = np.array([ray(tilt, turn, 3.0) for tilt, turn in rng.uniform((0.0, 0.0), (0.7, 6.28), (200, 2))])
    said = camera.to_opencv()
    project = cv2.fisheye.projectPoints if said["model"] == "fisheye" else cv2.projectPoints
    theirs, _ = project(points[:, None], np.zeros(3), np.zeros(3), said["K"], said["D"])
    assert camera.project(points)[0] == pytest.approx(theirs[:, 0] + 0.5, abs=1e-6)


def test_a_lens_that_folds_ends_there():
    camera = PinholeModel(*VGA, -0.3)
    pixels, _ = camera.project([[1.0, 0.0, 1.0], [1.1, 0.0, 1.0]])
    assert not np.isnan(pixels[0]).any()
    assert np.isnan(pixels[1]).all(), "beyond the fold, pixels would come back to the middle"
    rays, found = camera.unproject([[500.0, 248.0], [640.0, 248.0]])
    assert found.tolist() == [True, False]
    assert np.isnan(rays[1]).all()


def test_the_published_calibration_of_woodscape_fits():
    """Its picture is not square, and its center is off by 3.9 and -3.1 px."""
    camera = CAMERAS["woodscape"]
    k = (339.749, -31.988, 48.275, -7.201)
    for u, v in ((0.5, 479.907), (643.942, 965.5), (1100.0, 100.0)):
        pixel_ray, found = camera.unproject([u, v])
        phi = math.acos(pixel_ray[2])
        radius = math.fsum(value * phi**power for power, value in enumerate(k, start=1))
        assert found
        assert radius == pytest.approx(math.hypot(u - 643.942, v - 479.907), abs=0.01)
    assert not camera.unproject([0.5, 0.5])[1], "the corners are beyond the lens"


def test_kalibr_gets_the_models_that_it_has():
    assert CAMERAS["euroc"].to_kalibr() == {
        "camera_model": "pinhole",
        "intrinsics": [458.654, 457.296, 367.215, 248.375],
        "distortion_model": "radtan",
        "distortion_coeffs": [-0.28340811, 0.07395907, 1.9359e-4, 1.76187e-5],
        "resolution": [752, 480],
    }
    sphere = CAMERAS["double sphere"].to_kalibr()
    assert (sphere["camera_model"], sphere["intrinsics"][:2]) == ("ds", [-0.1977, 0.5768])
    for camera in (CAMERAS["double sphere"], CAMERAS["woodscape"]):
        with pytest.raises(CalibrationError):
            camera.to_opencv()


def test_a_lens_with_k3_is_fitted_for_kalibr():
    near, rms = fit_radtan(CAMERAS["thick"])
    said = CAMERAS["thick"].to_kalibr()
    assert (said["distortion_model"], said["fit_rms_px"]) == ("radtan", rms)
    assert rms < 0.3
    rays, _ = CAMERAS["thick"].unproject(np.random.default_rng(2).uniform((0, 0), (640, 480), (300, 2)))
    off = np.linalg.norm(near.project(rays)[0] - CAMERAS["thick"].project(rays)[0], axis=-1)
    assert math.sqrt(np.nanmean(off**2)) < 2 * rms + 0.05


def test_opencv_is_told_to_see_180_degrees_at_most():
    """OpenCV puts what is behind the camera on the other side of the picture."""
    camera = CAMERAS["tumvi"]
    said = camera.to_opencv()
    assert said["max_angle"] == math.pi / 2
    behind = ray(math.radians(95.0), 0.0)
    theirs, _ = cv2.fisheye.projectPoints(np.array([[behind]]), np.zeros(3), np.zeros(3), said["K"], said["D"])
    assert np.linalg.norm(theirs[0, 0] + 0.5 - camera.project(behind)[0]) > 100
    narrow = FisheyeModel.from_lens(kannala_brandt_lens((0.0, 0.0, 0.0, 0.0), math.pi), 64)
    assert "max_angle" not in narrow.to_opencv()


@pytest.mark.parametrize(("preset", "fov", "limit"), [("woodscape", 190.0, 0.2), ("equisolid", 180.0, 0.02)])
def test_a_quartic_lens_is_fitted_for_kalibr(preset, fov, limit):
    camera = FisheyeModel(1280, 966, 339.749, 339.749, 643.942, 479.907, preset_lens(preset, math.radians(fov)))
    near, rms = camera.fit_kannala_brandt()
    assert camera.to_kalibr()["fit_rms_px"] == rms < limit
    rays = np.array([ray(tilt, 0.3) for tilt in np.linspace(0.0, math.radians(0.5 * fov), 50)])
    off = np.linalg.norm(camera.project(rays)[0] - near.project(rays)[0], axis=-1)
    assert np.nanmax(off) < 5 * limit


@pytest.mark.parametrize(
    "change",
    [{"width": 0}, {"height": -3}, {"fx": 0.0}, {"fy": -1.0}, {"cx": math.nan}, {"fx": math.inf}],
)
def test_cameras_that_cannot_be_are_refused(change):
    values = dict(zip(("width", "height", "fx", "fy", "cx", "cy"), VGA, strict=True))
    with pytest.raises(CalibrationError):
        PinholeModel(**{**values, **change})


@pytest.mark.parametrize(("xi", "alpha"), [(1.5, 0.5), (0.0, -0.1), (0.0, 1.1)])
def test_double_spheres_that_cannot_be_are_refused(xi, alpha):
    with pytest.raises(CalibrationError, match="double sphere"):
        DoubleSphereModel(*VGA, xi, alpha)


def test_lenses_of_other_lengths_are_refused():
    with pytest.raises(ValueError, match="four"):
        Lens((1.0, 0.1), math.pi)
    with pytest.raises(ValueError, match="does not grow beyond"):
        kannala_brandt_lens((-1.0, 0.0, 0.0, 0.0), math.pi)
