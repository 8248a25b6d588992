"""The camera's geometry compared with the vectors, in all fidelities."""

import json
import math
from pathlib import Path

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from world.optics import FieldOfViewCamera
from world.sensors import (
    AttitudeAndHeight,
    detect_target,
    detection_at_pixel,
    ground_position_sigma,
    locate_like_original_camera,
    locate_target_on_plane,
    original_mug_camera,
    target_in_camera,
)

DATA = Path(__file__).parents[2] / "data" / "sensors"
DEFAULT = FieldOfViewCamera(1280, 960, math.radians(92.8), math.radians(50.0))


def rows(name):
    return json.loads((DATA / f"{name}.json").read_text())


def camera_of(given):
    return FieldOfViewCamera(given["W"], given["H"], math.radians(given["hfov"]), math.radians(given["vfov"]))


def offset(seen):
    return seen.north, seen.east


@pytest.mark.parametrize("row", rows("mug_physical"))
def test_physical(row):
    given, camera = row["in"], camera_of(row["in"])
    to_mug = tuple(m - v for m, v in zip(given["mug_ned"], given["veh_ned"], strict=True))
    height = given["z_plane"] - given["veh_ned"][2]
    view = AttitudeAndHeight(given["phi"], given["theta"], given["psi"], height)
    point = camera.project(*target_in_camera(view._replace(height=to_mug[2]), to_mug[:2]))
    seen = detect_target(camera, view, to_mug[:2])
    assert (seen is not None) is row["visible"]
    if row["uv"] is None:
        assert point is None
        return
    assert point == pytest.approx(row["uv"], abs=1e-6, rel=1e-8)
    assert camera.is_in_image(*point) is row["visible"]
    for at, expected in (
        (point, row["ned_back"]),
        ([math.floor(x) + 0.5 for x in point], row["ned_from_pixel_centre"]),
    ):
        back = detection_at_pixel(camera, *at, view)
        north, east = given["veh_ned"][:2]
        assert (back.north + north, back.east + east) == pytest.approx(expected[:2], abs=1e-8, rel=1e-9)


@pytest.mark.parametrize("row", rows("mug_original"))
def test_original(row):
    given, camera = row["in"], camera_of(row["in"])
    target, alt, psi = (given["dN"], given["dE"]), given["alt"], given["psi"]
    assert original_mug_camera.is_visible(camera, alt, *target) is row["visible"]
    pixel = original_mug_camera.to_pixel(camera, alt, psi, *target)
    assert list(pixel) == row["pixel"]
    back = original_mug_camera.to_offset(camera, alt, psi, *pixel)
    assert back == pytest.approx(row["ned_from_pixel"], abs=1e-8, rel=1e-9)
    assert original_mug_camera.error_bound(camera, alt) == pytest.approx(row["err_bound"], abs=1e-8, rel=1e-9)
    assert locate_like_original_camera(camera, AttitudeAndHeight(0.0, 0.0, psi, alt), target) == (
        back if row["visible"] else None
    )


@pytest.mark.parametrize("row", [row for row in rows("mug_edges") if "u" in row])
def test_borders(row):
    assert DEFAULT.is_in_image(row["u"], row["v"]) is row["visible"]


def test_original_border_is_not_visible():
    limit = 10.0 * math.tan(0.5 * DEFAULT.horizontal)
    assert not original_mug_camera.is_visible(DEFAULT, 10.0, limit, 0.0)
    assert original_mug_camera.is_visible(DEFAULT, 10.0, math.nextafter(limit, 0.0), 0.0)


def test_default_example():
    assert DEFAULT.project(*target_in_camera(AttitudeAndHeight(0.0, 0.0, 0.0, 10.0), (1.0, 0.3))) == pytest.approx(
        (658.28, 377.06), abs=0.01
    )


TILT, SIDE = st.floats(-0.4, 0.4), st.floats(-1.0, 1.0)


@given(TILT, TILT, st.floats(-10.0, 10.0), st.floats(0.5, 80.0), SIDE, SIDE)
def test_through_the_pixel_and_back(phi, theta, psi, height, north, east):
    view, target = AttitudeAndHeight(phi, theta, psi, height), (north * height, east * height)
    point = DEFAULT.project(*target_in_camera(view, target))
    assume(point is not None and DEFAULT.is_in_image(*point))
    back = detection_at_pixel(DEFAULT, *point, view)
    assert (back.north, back.east) == pytest.approx(target, abs=1e-9 * max(1.0, height))
    seen = offset(detect_target(DEFAULT, view, target))
    assert locate_target_on_plane(DEFAULT, view, target, view) == seen
    if phi == theta == 0.0:
        size = math.hypot(
            DEFAULT.ground_sample_distance(height), height * 2 * math.tan(0.5 * DEFAULT.vertical) / DEFAULT.height
        )
        assert math.dist(seen, target) <= 0.5 * size + 1e-9


@pytest.mark.parametrize(
    "view",
    [
        AttitudeAndHeight(math.pi, 0.0, 0.0, 10.0),
        AttitudeAndHeight(0.0, 0.0, 0.0, -1.0),
        AttitudeAndHeight(0.0, 0.0, 0.0, 0.0),
    ],
)
def test_nothing_is_seen_upwards_or_on_the_plane(view):
    assert detect_target(DEFAULT, view, (0.0, 0.0)) is None
    assert locate_target_on_plane(DEFAULT, view, (0.0, 0.0), view) is None


def test_heading_does_not_move_a_target():
    for psi in (0.0, 1.0, math.pi / 2, 3.0, -2.0):
        assert offset(detect_target(DEFAULT, AttitudeAndHeight(0.0, 0.0, psi, 10.0), (1.0, 0.3))) == pytest.approx(
            (1.0, 0.3), abs=0.02
        )


def test_gsd_error_shrinks_with_resolution_and_grows_with_height():
    fine = FieldOfViewCamera(2560, 1920, DEFAULT.horizontal, DEFAULT.vertical)
    assert ground_position_sigma(fine, 10.0, (0.0, 0.0)) < ground_position_sigma(DEFAULT, 10.0, (0.0, 0.0))
    assert ground_position_sigma(DEFAULT, 20.0, (2.0, 0.0)) > ground_position_sigma(DEFAULT, 10.0, (1.0, 0.0))
    assert DEFAULT.ground_sample_distance(10.0) == pytest.approx(0.0164, abs=1e-4)
