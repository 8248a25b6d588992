"""The inverse map, and pictures assembled with it."""

import json
import math
import sys
from pathlib import Path

import numpy as np
import pytest

from world.optics import FisheyeModel, Lens, PinholeModel, preset_lens
from world.rendering import uncovered_warning
from world.rendering.cube_faces import WIDEST_OF_FIVE, face_rotations, pixel_axis, stack_faces
from world.rendering.remap_interpolation import BilinearResampler, NearestResampler, make_resampler
from world.rendering.remap_table import OUTSIDE, VOID, RemapTable, finest_face_width

VECTORS = json.loads((Path(__file__).parents[2] / "data/sensors/fisheye.json").read_text())
# Field of view, width of face and picture, and the rms errors allowed, nearest and blended, of 255.
SPHERES = [
    (180, 256, 512, 0.8, 0.03),
    (180, 512, 1024, 0.4, 0.012),
    (220, 512, 1024, 0.4, 0.012),
    (270, 512, 1024, 0.4, 0.012),
]


def color(ray):
    return 0.5 + 0.5 * np.sin(6 * ray)


def sphere_faces(width):
    """The analytic sphere in five faces (5, w, w, 3), 0 to 255, exact."""
    x, y = np.meshgrid(pixel_axis(width).astype(np.float64), pixel_axis(width).astype(np.float64))
    ray = np.stack([x, y, np.ones_like(x)], axis=-1)
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    return np.stack([255 * color(ray @ turn.T) for turn in face_rotations(5)])


def look_up(name, fov, size, width, faces=5):
    return RemapTable(FisheyeModel.from_lens(preset_lens(name, math.radians(fov)), size), width, faces)


@pytest.fixture(scope="module", params=SPHERES, ids=lambda p: f"{p[0]}-{p[2]}")
def sphere(request):
    fov, width, size, *gates = request.param
    optics = FisheyeModel.from_lens(preset_lens("equisolid", math.radians(fov)), size)
    lookup = RemapTable(optics, width)
    return lookup, 255 * color(optics.pixel_rays()[0]), sphere_faces(width), gates


@pytest.mark.parametrize("case", VECTORS["fisheye_lookup"], ids=lambda c: f"{c['lens']}-{c['fov_deg']}")
def test_lookup_matches_the_vectors(case):
    optics = FisheyeModel.from_lens(Lens(tuple(case["k"]), math.radians(case["fov_deg"])), case["size"])
    lookup = RemapTable(optics, case["face_width"])
    rays, _ = optics.pixel_rays()
    pixels, angles = VECTORS["_tolerances"]["pixels"], VECTORS["_tolerances"]["angles_rad"]
    for i, j, inside, phi, theta, face, u, v in case["rows"]:
        assert lookup.face[j, i] == (face if inside else OUTSIDE)
        if inside:
            x, y, z = rays[j, i]
            assert math.acos(z) == pytest.approx(phi, abs=angles[0], rel=angles[1])
            assert math.atan2(y, x) == pytest.approx(theta, abs=angles[0], rel=angles[1])
        if inside and face >= 0:
            assert (lookup.u[j, i], lookup.v[j, i]) == pytest.approx((u, v), abs=pixels[0], rel=pixels[1])
        else:
            assert math.isnan(lookup.u[j, i])


def test_nearest_pixels_show_the_sphere_within_the_gate(sphere):
    lookup, wanted, faces, (gate, _) = sphere
    seen = lookup.face >= 0
    face, u, v = lookup.face[seen], lookup.u[seen], lookup.v[seen]
    last = lookup.face_width - 1
    got = faces[face, np.clip(np.rint(v), 0, last).astype(int), np.clip(np.rint(u), 0, last).astype(int)]
    assert np.sqrt(np.mean((got - wanted[seen]) ** 2)) <= gate
    picture = NearestResampler(lookup)(stack_faces(np.rint(faces).astype(np.uint8)))
    np.testing.assert_array_equal(picture[seen][:, :3], np.rint(got))


def test_blended_pixels_show_the_sphere_within_the_gate(sphere):
    lookup, wanted, faces, (_, gate) = sphere
    seen = lookup.face >= 0
    last = lookup.face_width - 1
    face, u, v = lookup.face[seen], np.clip(lookup.u[seen], 0, last), np.clip(lookup.v[seen], 0, last)
    left, top = np.minimum(u.astype(int), last - 1), np.minimum(v.astype(int), last - 1)
    right, below = (u - left)[:, None], (v - top)[:, None]
    upper = faces[face, top, left] * (1 - right) + faces[face, top, left + 1] * right
    lower = faces[face, top + 1, left] * (1 - right) + faces[face, top + 1, left + 1] * right
    got = upper * (1 - below) + lower * below
    assert np.sqrt(np.mean((got - wanted[seen]) ** 2)) <= gate
    picture = BilinearResampler(lookup)(stack_faces(np.rint(faces).astype(np.uint8)))
    error = picture[seen][:, :3] - got
    assert np.abs(error).max() < 2
    assert abs(error.mean()) < 0.05


def test_opencv_blends_alike():
    lookup = look_up("equidistant", 220, 128, 64)
    atlas = stack_faces(np.rint(sphere_faces(64)).astype(np.uint8))
    through_opencv = make_resampler(lookup, "opencv")(atlas).astype(int)
    assert np.abs(through_opencv - BilinearResampler(lookup)(atlas)).max() <= 2


def test_bilinear_pictures_do_not_depend_on_opencv(monkeypatch):
    monkeypatch.setitem(sys.modules, "cv2", None)
    lookup = look_up("equidistant", 220, 64, 32)
    atlas = stack_faces(np.rint(sphere_faces(32)).astype(np.uint8))
    np.testing.assert_array_equal(make_resampler(lookup, "bilinear")(atlas), BilinearResampler(lookup)(atlas))
    with pytest.raises(ImportError):
        make_resampler(lookup, "opencv")


def test_outside_and_void_are_transparent_black():
    lookup = look_up("equidistant", 270, 128, 16)
    assert lookup.uncovered_share == pytest.approx(0.0453, abs=2e-3)
    atlas = stack_faces([np.full((16, 16, 4), 200, dtype=np.uint8)] * 5)
    for picture in (NearestResampler(lookup)(atlas), BilinearResampler(lookup)(atlas)):
        np.testing.assert_array_equal(picture[lookup.face < 0], 0)
        np.testing.assert_array_equal(picture[lookup.face >= 0], 200)
    assert {OUTSIDE, VOID} <= set(lookup.face.ravel().tolist())


@pytest.mark.parametrize(("fov", "faces", "gaps"), [(250.5, 5, False), (252, 5, True), (270, 5, True), (360, 6, False)])
def test_five_faces_leave_gaps_beyond_their_corners(fov, faces, gaps):
    lookup = look_up("equidistant", fov, 256, 16, faces)
    assert (lookup.uncovered_share > 0) == gaps
    assert bool(uncovered_warning(math.radians(fov), faces)) == gaps


def test_the_warning_names_the_widest_field_of_view():
    assert math.degrees(WIDEST_OF_FIVE) == pytest.approx(250.53, abs=5e-3)
    assert "250.53°" in uncovered_warning(math.radians(270), 5)


@pytest.mark.parametrize("interpolation", ["nearest", "bilinear", "opencv"])
def test_only_the_named_rows_are_read(interpolation):
    lookup = look_up("equidistant", 180, 128, 32)
    assert lookup.rows[0] == (0, 32)
    faces = np.full((5, 32, 32, 4), 99, dtype=np.uint8)
    for face, (first, last) in zip(faces, lookup.rows, strict=True):
        face[:first] = face[last:] = 0
    assert lookup.rows[1][0] > 10
    picture = make_resampler(lookup, interpolation)(stack_faces(list(faces)))
    np.testing.assert_array_equal(picture[lookup.face >= 0], 99)


@pytest.mark.parametrize(("size", "width"), [(1, 1), (2, 1), (1, 64), (3, 2)])
def test_the_smallest_pictures(size, width):
    lookup = look_up("equidistant", 180, size, width)
    atlas = stack_faces([np.full((width, width, 4), 7, dtype=np.uint8)] * 5)
    for sample in (NearestResampler(lookup), BilinearResampler(lookup)):
        np.testing.assert_array_equal(sample(atlas)[lookup.face >= 0], 7)


def test_another_atlas_is_refused():
    lookup = look_up("equidistant", 180, 16, 8)
    for sample in (NearestResampler(lookup), BilinearResampler(lookup), make_resampler(lookup, "opencv")):
        with pytest.raises(ValueError, match="atlas"):
            sample(np.zeros(5 * 64, dtype=np.uint32))
    with pytest.raises(ValueError, match="no pixels"):
        look_up("equidistant", 180, 16, 0)
    with pytest.raises(ValueError, match="5 or 6"):
        look_up("equidistant", 180, 16, 8, faces=4)


@pytest.mark.parametrize("width", [639, 640, 641, 642])
def test_the_nearest_pixels_of_a_face_are_not_all_on_one_side(width):
    """Else the whole picture would be shifted by half a pixel."""
    focal = 0.5 * width / math.tan(math.radians(40.0))
    optics = PinholeModel(width, 480, focal, focal, 0.5 * width, 240.0)
    right = RemapTable(optics, finest_face_width(optics)).u[240, width // 2 :]
    assert abs(np.mean(np.rint(right) - right)) < 0.2
