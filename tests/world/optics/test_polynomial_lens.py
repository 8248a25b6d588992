"""Lenses, and the image points of rays."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from world.optics import LENS_PRESETS, FisheyeModel, Lens, preset_lens

VECTORS = json.loads((Path(__file__).parents[2] / "data/sensors/fisheye.json").read_text())


@pytest.mark.parametrize("case", VECTORS["fisheye_lens_inverse"])
def test_inverse_matches_the_vectors(case):
    lens = Lens(tuple(case["k"]), math.radians(case["fov_deg"]))
    absolute, relative = VECTORS["_tolerances"]["angles_rad"]
    np.testing.assert_allclose(lens.angle(case["r"]), case["phi"], rtol=relative, atol=absolute)


@pytest.mark.parametrize("case", VECTORS["fisheye_nonmonotone"])
def test_lenses_that_make_no_sense_are_refused(case):
    fov = math.radians(case["fov_deg"])
    if case["expect"] == "ok":
        assert Lens(tuple(case["k"]), fov).edge_radius > 0
    else:
        with pytest.raises(ValueError, match=r"°|zero"):
            Lens(tuple(case["k"]), fov)


def test_a_bend_inside_the_field_of_view_is_found_however_narrow():
    """r' touches zero at 0.7 rad only."""
    k3 = 1 / (3 * 0.49)
    with pytest.raises(ValueError, match=r"the image radius of the lens .* does not grow"):
        Lens((1.0, -3 * k3 * 0.7, k3, 0.0), math.radians(160))


@pytest.mark.parametrize("k", [(1.0, math.nan, 0.0, 0.0), (1.0, 0.0, 0.0), (math.inf, 0.0, 0.0, 0.0)])
def test_a_lens_has_four_finite_coefficients(k):
    with pytest.raises(ValueError, match="four finite"):
        Lens(k, 1.0)


@pytest.mark.parametrize("name", LENS_PRESETS)
def test_inverse_of_every_preset_to_a_trillionth(name):
    lens = preset_lens(name, math.radians(170))
    phi = np.linspace(0, lens.edge_angle, 4999)
    np.testing.assert_allclose(lens.angle(lens.radius(phi)), phi, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("name", "ideal", "widest", "error"),
    [
        ("equidistant", lambda phi: phi, 135, 0),
        ("equisolid", lambda phi: 2 * np.sin(phi / 2), 135, 1.5e-4),
        ("stereographic_220", lambda phi: 2 * np.tan(phi / 2), 110, 8.5e-3),
        ("orthographic", np.sin, 85, 2.5e-4),
    ],
)
def test_presets_follow_their_names(name, ideal, widest, error):
    lens = preset_lens(name, math.radians(2 * widest))
    phi = np.linspace(0, lens.edge_angle, 999)
    assert np.abs(lens.radius(phi) - ideal(phi)).max() <= error


@pytest.mark.parametrize(("name", "fov"), [("stereographic_220", 221), ("orthographic", 171), ("tumvi_195", 196)])
def test_presets_are_refused_beyond_their_fit(name, fov):
    with pytest.raises(ValueError, match=f"up to {fov - 1}°"):
        preset_lens(name, math.radians(fov))


@pytest.mark.parametrize(
    ("k", "angle"),
    [((1.0, 0.0, -0.3, 0.0), "60.4"), ((1.0, -1.0, 1 / 3, 0.0), "57.3"), ((-1.0, 0.0, 0.0, 0.0), "0")],
)
def test_a_lens_that_folds_is_refused_with_the_angle(k, angle):
    with pytest.raises(ValueError, match=f"does not grow beyond {angle}° off its axis: up to 90°"):
        Lens(k, math.pi)


def test_a_lens_may_fold_beyond_its_field_of_view():
    assert Lens((1.0, 0.0, -0.3, 0.0), math.radians(120.0)).edge_radius > 0.7


def test_a_lens_needs_four_coefficients():
    with pytest.raises(ValueError, match=r"four finite coefficients, not \[1.0, 0.2\]"):
        Lens((1.0, 0.2), math.pi)


def test_the_image_circle_fits_the_image_unless_a_scale_is_given():
    lens = preset_lens("woodscape", math.radians(190))
    assert FisheyeModel.from_lens(lens, 960).circle_diameter == pytest.approx(960)
    assert FisheyeModel.from_lens(lens, 960, 339.749).circle_diameter == pytest.approx(2 * 339.749 * lens.edge_radius)


@pytest.mark.parametrize(("size", "scale"), [(0, 0.0), (-1, 0.0), (64, -1.0), (64, math.nan)])
def test_images_without_pixels_are_refused(size, scale):
    with pytest.raises(ValueError, match=r"px|fx is nan"):
        FisheyeModel.from_lens(preset_lens("equidistant", math.pi), size, scale)


@pytest.mark.parametrize(("name", "fov"), [("equidistant", 260), ("tumvi_195", 195)])
def test_rays_and_pixels_are_inverse(name, fov):
    optics = FisheyeModel.from_lens(preset_lens(name, math.radians(fov)), 33)
    rays, inside = optics.pixel_rays()
    i, j = np.meshgrid(np.arange(33) + 0.5, np.arange(33) + 0.5)
    np.testing.assert_allclose(optics.project(rays)[0][inside], np.stack([i, j], axis=-1)[inside], atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(rays[inside], axis=-1), 1)
    assert not inside[0, 0]
    assert inside[16].all()


def test_the_middle_of_the_image_looks_along_the_axis():
    optics = FisheyeModel.from_lens(preset_lens("equidistant", math.pi), 64)
    np.testing.assert_allclose(optics.project([[0.0, 0.0, 7.0]])[0], [[32, 32]])
    np.testing.assert_allclose(optics.project([[1.0, 0.0, 1.0]])[0], [[48, 32]])
    assert np.isnan(optics.project([[1.0, 0.0, -0.1]])[0]).all()


@pytest.mark.parametrize(("width", "height"), [(64, 48), (65, 49), (1, 1), (2, 7)])
def test_rays_of_all_pixels_are_those_of_each_pixel(width, height):
    """A picture whose middle is on the axis is computed once for four pixels."""
    optics = FisheyeModel(width, height, 20.0, 22.0, width / 2, height / 2, preset_lens("equisolid", math.pi))
    for model in (optics, replace(optics, cx=optics.cx + 0.25)):
        rays, covered = model.pixel_rays()
        u, v = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
        each, valid = model.unproject(np.stack((u, v), axis=-1))
        np.testing.assert_array_equal(rays, each)
        np.testing.assert_array_equal(covered, valid)
