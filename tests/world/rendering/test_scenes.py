"""The seabed in pictures: sand that does not burn out, and ripples that do not repeat."""

import math

import numpy as np
import pytest

from world.rendering import procedural_textures
from world.rendering.light import scene_colors
from world.rendering.renderer import Renderer
from world.rendering.scenes import ScenePose, make_scene

ONE_FACE = ((0, 0),) * 4


def below(scene, pose, width):
    """Colors (width, width, 3) of the view straight down, 90° wide."""
    renderer = Renderer(scene, width, 5, ((0, width), *ONE_FACE))
    return renderer.render(pose)[: width * width].view(np.uint8).reshape(width, width, 4)[..., :3]


@pytest.mark.parametrize("visibility", [5.0, 20.0, 200.0])
@pytest.mark.parametrize("depth", [0.5, 10.0, 60.0])
def test_sand_does_not_burn_out(visibility, depth):
    scene = make_scene("Seabed", visibility, 3)
    for height in (0.5, 1.0, 2.6, 5.0, 15.0):
        for north in (0.0, 40.0):
            picture = below(scene, ScenePose(north, 3.0, height, depth), 128)
            assert np.mean(picture.max(axis=-1) == 255) < 0.01
            assert picture.mean() > 30


def test_far_from_the_ground_the_exposure_is_that_of_the_water():
    """The aperture closes only where bright sand asks for it."""
    scene = make_scene("Seabed", 20.0, 3)
    pose = ScenePose(0.0, 0.0, 15.0, 10.0)
    np.testing.assert_array_equal(scene._lit(pose)[0](12.0), scene.water.daylight(12.0, 10.0))
    assert scene._lit(ScenePose(0.0, 0.0, 0.5, 10.0))[0](12.0)[1] < 0.7 * scene.water.daylight(12.0, 10.0)[1]


@pytest.mark.heavy
@pytest.mark.parametrize("corner", [(100, 100), (990, 990)])
def test_the_seabed_does_not_repeat(corner):
    """A place of 4 m x 4 m is like no other one within 100 m, except where it is: 120 m of ground seen from 60 m."""
    size, meter = 68, 2048 / 120
    ground = below(make_scene("Seabed", 1e6, 1), ScenePose(0.0, 0.0, 60.0, 10.0), 2048)
    likeness = correlation(ground[..., 1].astype(float), corner, size)
    near = int(1.2 * meter)
    assert likeness[corner] == pytest.approx(1.0, abs=1e-6)
    likeness[tuple(slice(place - near, place + near) for place in corner)] = 0.0
    assert likeness.max() < 0.55


def correlation(picture, corner, size):
    """Normalized cross-correlation of the square at a corner with the picture."""
    patch = picture[tuple(slice(place, place + size) for place in corner)]
    patch = patch - patch.mean()
    spectrum, shape = np.fft.rfft2(picture), picture.shape
    box = np.fft.rfft2(np.ones((size, size)), s=shape).conj()
    mean = np.fft.irfft2(spectrum * box, s=shape) / size**2
    power = np.fft.irfft2(np.fft.rfft2(picture**2) * box, s=shape) / size**2
    dot = np.fft.irfft2(spectrum * np.fft.rfft2(patch, s=shape).conj(), s=shape)
    found = dot / np.sqrt(np.maximum(power - mean**2, 1e-9) * size**2 * np.sum(patch**2))
    return found[:-size, :-size]


def test_a_pyramid_holds_tones_and_bends_at_all_scales():
    random = np.random.default_rng(5)
    tones = random.random((64, 64), dtype=np.float32)
    bends = 255 * random.random((64, 64), dtype=np.float32)
    pyramid = procedural_textures.tone_and_shift_pyramid(tones, bends)
    np.testing.assert_array_equal(
        pyramid[:, :64] % procedural_textures.TONES, np.floor(tones * procedural_textures.TONES)
    )
    np.testing.assert_array_equal(pyramid[:, :64] // procedural_textures.TONES, np.floor(bends))
    assert pyramid[0, 126] // procedural_textures.TONES == math.floor(bends.mean())
    np.testing.assert_array_equal(procedural_textures.tone_pyramid(tones), pyramid % procedural_textures.TONES)


def test_words_are_those_of_the_encoding():
    linear = np.random.default_rng(2).uniform(0.0, 1.3, (3, 5, 7)).astype(np.float32)
    words = scene_colors.rgba_words(linear.copy()).view(np.uint8).reshape(5, 7, 4)
    np.testing.assert_array_equal(words[..., :3], np.floor(np.moveaxis(scene_colors.gamma_encode(linear), 0, -1)))
    assert (words[..., 3] == 255).all()


@pytest.mark.heavy
@pytest.mark.parametrize("draw", [procedural_textures.underwater_textures, procedural_textures.wave_and_cloud_textures])
def test_textures_are_drawn_once_for_all_cameras_of_a_seed_and_again_the_same(draw):
    shared = draw(5)
    assert draw(5) is shared
    for kept, again, other in zip(shared, draw.__wrapped__(5), draw.__wrapped__(6), strict=True):
        assert not kept.flags.writeable
        assert np.array_equal(kept, again)
        assert not np.array_equal(kept, other)
