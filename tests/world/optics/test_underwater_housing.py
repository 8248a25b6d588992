"""Cameras behind glass in water, against a tracer that knows only that light takes the quickest way."""

import math

import numpy as np
import pytest

from world.optics import (
    CalibrationError,
    DomePort,
    FisheyeModel,
    FlatPort,
    HousedModel,
    PinholeModel,
    preset_lens,
    put_behind_port,
)

FOCAL = 320 / math.tan(math.radians(40.0))
PINHOLE = PinholeModel(640, 480, FOCAL, FOCAL, 320.0, 240.0)
BROWN = PinholeModel(640, 480, FOCAL, FOCAL, 310.0, 250.0, -0.2, 0.04, 1e-3, -5e-4)
FISHEYE = FisheyeModel.from_lens(preset_lens("equidistant", math.radians(150)), 500)
PORTS = {
    "flat": FlatPort(distance=0.05),
    "touching": FlatPort(distance=0.0, thickness=0.0),
    "thick": FlatPort(0.04, 1.52, 1.33, 0.1),
    "dome": DomePort(offset=0.02),
    "dome, behind": DomePort(0.005, 1.52, 1.34, 0.1, -0.015),
}


def quickest(port, across, along):
    """The angle in air (rad) of the quickest way from the camera to a point in water, through both faces of the glass.

    Fermat's principle: nested searches for the places on the two faces that make the optical path the shortest.
    """

    def inner(s):
        if isinstance(port, FlatPort):
            return np.array([s, port.distance])
        return np.array([port.radius * math.sin(s), port.radius * math.cos(s) - port.offset])

    def outer(s):
        if isinstance(port, FlatPort):
            return np.array([s, port.distance + port.thickness])
        far = port.radius + port.thickness
        return np.array([far * math.sin(s), far * math.cos(s) - port.offset])

    def length(pair):
        first, second = inner(pair[0]), outer(pair[1])
        end = np.array([across, along])
        return (
            math.hypot(*first) + port.glass * math.hypot(*(second - first)) + port.water * math.hypot(*(end - second))
        )

    # Newton on the gradient, by differences: the path is smooth and has one stationary point near the straight way.
    seen = math.atan2(across, along)
    start = port.distance * math.tan(seen) / 1.0 if isinstance(port, FlatPort) else seen
    pair, h = np.array([start, start]), 1e-4 if isinstance(port, FlatPort) else 1e-3
    for _ in range(60):
        steps = np.eye(2) * h
        gradient = np.array([(length(pair + s) - length(pair - s)) / (2 * h) for s in steps])
        hessian = np.array(
            [
                [
                    (length(pair + a + b) - length(pair + a - b) - length(pair - a + b) + length(pair - a - b))
                    / (4 * h * h)
                    for b in steps
                ]
                for a in steps
            ]
        )
        pair = pair - np.linalg.solve(hessian, gradient)
        h = max(h / 2, 1e-5)
    return math.atan2(*inner(pair[0]))


@pytest.mark.parametrize("name", [name for name in PORTS if name != "touching"])
@pytest.mark.parametrize("distance", [0.5, 3.0])
def test_light_takes_the_quickest_way(name, distance):
    port = PORTS[name]
    camera = put_behind_port(PINHOLE, port, 2.0)
    assert isinstance(camera, HousedModel)
    for seen in (0.05, 0.2, 0.4):
        point = distance * np.array([math.sin(seen) * 0.8, math.sin(seen) * 0.6, math.cos(seen)])
        pixel, valid = camera.project_refracted(point)
        angle = quickest(port, distance * math.sin(seen), distance * math.cos(seen))
        wanted = PINHOLE.project([math.sin(angle) * 0.8, math.sin(angle) * 0.6, math.cos(angle)])[0]
        assert valid
        np.testing.assert_allclose(pixel, wanted, atol=2e-3)


@pytest.mark.parametrize("name", PORTS)
@pytest.mark.parametrize("subject", [0.6, 2.0, math.inf])
@pytest.mark.parametrize("inner", [PINHOLE, BROWN, FISHEYE], ids=["pinhole", "brown", "fisheye"])
def test_a_ray_comes_back_through_its_pixel(inner, subject, name):
    camera = put_behind_port(inner, PORTS[name], subject)
    random = np.random.default_rng(2)
    pixels = random.uniform((0, 0), (inner.width, inner.height), (300, 2))
    rays, valid = camera.unproject(pixels)
    assert valid.mean() > 0.5
    np.testing.assert_allclose(np.linalg.norm(rays[valid], axis=-1), 1.0)
    back, seen = camera.project(3.0 * rays[valid])
    assert seen.all()
    np.testing.assert_allclose(back, pixels[valid], atol=1e-6)


@pytest.mark.parametrize("name", PORTS)
@pytest.mark.parametrize("inner", [PINHOLE, BROWN, FISHEYE], ids=["pinhole", "brown", "fisheye"])
def test_slopes_are_those_of_the_pixels(inner, name):
    camera = put_behind_port(inner, PORTS[name], 2.0)
    random = np.random.default_rng(3)
    points = np.vstack([random.uniform((-0.5, -0.4, 0.8), (0.5, 0.4, 3.0), (50, 3)), [[0.0, 0.0, 2.0]]])
    step, found = 1e-5, camera.jacobian(points)
    for axis, nudge in enumerate(np.eye(3) * step):
        wanted = (camera.project(points + nudge)[0] - camera.project(points - nudge)[0]) / (2 * step)
        np.testing.assert_allclose(found[:, :, axis], wanted, atol=2e-3)


@pytest.mark.parametrize("name", PORTS)
def test_what_is_as_far_as_the_subject_is_exact(name):
    camera = put_behind_port(PINHOLE, PORTS[name], 2.0)
    rays, valid = camera.unproject(np.random.default_rng(5).uniform((1, 1), (639, 479), (200, 2)))
    exact, seen = camera.project_refracted(2.0 * rays[valid])
    assert seen.all()
    np.testing.assert_allclose(exact, camera.project(rays[valid])[0], atol=1e-5)


def test_a_flat_port_narrows_the_view():
    """To asin(sin(half) / n), whatever its distance; 80° become 57.3°."""
    camera = put_behind_port(PINHOLE, FlatPort(distance=0.05, water=1.34))
    border, _ = camera.unproject([640.0, 240.0])
    assert 2 * math.degrees(math.atan2(border[0], border[2])) == pytest.approx(57.3, abs=0.05)
    assert math.atan2(border[0], border[2]) == pytest.approx(math.asin(math.sin(math.radians(40.0)) / 1.34))
    assert camera.jacobian([0.0, 0.0, 1.0])[0, 0] == pytest.approx(1.34 * FOCAL, rel=1e-6)


def test_how_far_a_flat_port_is_off_elsewhere_than_told():
    """docs/water.md: 80°, 640 px, a pane of 1 cm 3 cm away, right at 2 m: what is at 1 m is off by 1 to 2 px."""
    camera = put_behind_port(PINHOLE, FlatPort(), 2.0)
    assert isinstance(camera, HousedModel)
    rays, _ = camera.unproject(np.stack(np.meshgrid(np.arange(10.0, 640, 10), np.arange(10.0, 480, 10)), axis=-1))
    worst = {}
    for distance in (1.0, 2.0, 4.0, 1000.0):
        pixels, seen = camera.project_refracted(distance * rays)
        worst[distance] = np.linalg.norm(pixels - camera.project(rays)[0], axis=-1)[seen].max()
    assert worst[2.0] < 1e-4
    assert 3.0 < worst[1.0] < 6.0
    assert 1.0 < worst[4.0] < worst[1000.0] < 6.0


def test_a_dome_around_the_center_of_the_lens_changes_nothing():
    camera = put_behind_port(FISHEYE, DomePort())
    pixels = np.random.default_rng(6).uniform((50, 50), (450, 450), (100, 2))
    np.testing.assert_allclose(camera.unproject(pixels)[0], FISHEYE.unproject(pixels)[0], atol=1e-12)
    assert put_behind_port(FISHEYE, None) is FISHEYE


def test_rays_behind_a_flat_port_do_not_meet_in_one_point():
    camera = put_behind_port(PINHOLE, FlatPort(distance=0.05, thickness=0.0), 2.0)
    assert isinstance(camera, HousedModel)
    middle, border = camera.axis_crossings([[320.5, 240.0], [640.0, 240.0]])
    assert middle == pytest.approx(0.05 * (1 - 1.34), abs=1e-5)  # the picture of the pupil in the pane
    assert border < middle - 0.009
    ray, _ = PINHOLE.unproject([640.0, 240.0])
    water = np.array([ray[0] / 1.34, 0.0, math.sqrt(1 - (ray[0] / 1.34) ** 2)])
    point = (0.0, 0.0, border) + 1.5 / water[2] * water
    np.testing.assert_allclose(camera.project_refracted(point)[0], [640.0, 240.0], atol=1e-4)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: FlatPort(distance=-0.1), "distance = -0.1"),
        (lambda: FlatPort(thickness=math.nan), "thickness = nan"),
        (lambda: FlatPort(water=0.5), "water = 0.5"),
        (lambda: DomePort(radius=0.05, offset=0.06), "offset = 0.06"),
        (lambda: put_behind_port(PINHOLE, FlatPort(distance=0.5), 0.3), "0.3 m away is within the port"),
        (lambda: put_behind_port(PINHOLE, FlatPort(), math.nan), "nan m away"),
        (lambda: put_behind_port(PINHOLE, FlatPort()).to_opencv(), "OpenCV has no port"),
    ],
)
def test_impossible_housings_are_refused(make, text):
    with pytest.raises(CalibrationError, match=text):
        make()
