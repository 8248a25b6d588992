"""Finds gliders in rendered pictures, and nothing else."""

import functools
import math

import numpy as np
import pytest

from world.detection import YELLOW, BlobDetector
from world.detection.connected_components import label_components
from world.optics import FisheyeModel, preset_lens
from world.rendering import Glider, SceneCamera, ScenePose
from world.rendering.renderer import optical_to_ned_rotation

WATER = np.array([60.0, 120.0, 110.0])
DETECTOR = BlobDetector()


@functools.cache
def fisheye(scene, size=512, visibility=40.0):
    optics = FisheyeModel.from_lens(preset_lens("equidistant", math.pi), size)
    return SceneCamera(optics, size // 2, scene=scene, visibility=visibility)


def noisy(image, sigma, seed):
    """With normal noise of a standard deviation, where the camera sees something."""
    found = image.copy()
    noise = np.random.default_rng(seed).normal(0.0, sigma, (*image.shape[:2], 3))
    found[..., :3] = np.where(image[..., 3:] > 0, np.clip(np.rint(image[..., :3] + noise), 0, 255), 0)
    return found


def plain(width=320, height=240, sigma=3.0, seed=0):
    image = np.empty((height, width, 4), np.uint8)
    image[..., :3], image[..., 3] = WATER, 255
    return noisy(image, sigma, seed)


@pytest.mark.heavy
@pytest.mark.parametrize("scene", ["Seabed", "Sea Surface"])
@pytest.mark.parametrize("sigma", [1.0, 4.0])
def test_finds_the_gliders_of_rendered_pictures_and_nothing_else(scene, sigma):
    random = np.random.default_rng(5)
    off = []
    for time in range(12):
        pose = ScenePose(
            *random.uniform(-50, 50, 2), 8.0, 4.0 * (scene == "Seabed"), *random.normal(0.0, 0.15, 3), time
        )
        places = ((3.0, -1.0), (-2.0, 4.0), (-4.0, -3.0))
        picture = fisheye(scene).take_picture(pose, [Glider(pose.north + n, pose.east + e) for n, e in places])
        expected = fisheye(scene).optics.project(
            np.array([(n, e, 8.0) for n, e in places]) @ optical_to_ned_rotation(pose)
        )[0]
        found = np.array([(mark.u, mark.v) for mark in DETECTOR.detect(noisy(picture, sigma, time))])
        assert len(found) == 3
        apart = np.linalg.norm(found[:, None] - expected, axis=-1)
        assert sorted(apart.argmin(axis=1)) == [0, 1, 2]
        off += apart.min(axis=1).tolist()
    assert math.sqrt(np.mean(np.square(off))) < 0.6


@pytest.mark.heavy
def test_a_glider_of_five_noise_levels_is_found_and_noise_is_not():
    """49 x 10 px: as long and wide as a glider 10 m below a camera of 610 px focal length."""
    hue = np.array(YELLOW) - np.mean(YELLOW)
    sigma, found, errors, others = 4.0, 0, [], 0
    color = WATER + 5.0 * sigma * hue / np.linalg.norm(hue)
    for seed in range(200):
        random = np.random.default_rng(seed)
        image = plain(seed=seed, sigma=0.0)
        left, top = int(random.integers(20, 240)), int(random.integers(20, 200))
        image[top : top + 10, left : left + 49, :3] = np.rint(color)
        marks = DETECTOR.detect(noisy(image, sigma, seed))
        near = [mark for mark in marks if math.hypot(mark.u - left - 24.5, mark.v - top - 5.0) < 5.0]
        found, others = found + bool(near), others + len(marks) - len(near)
        errors += [(mark.u - left - 24.5, mark.v - top - 5.0) for mark in near]
    assert found == 200
    assert others == 0
    assert np.sqrt(np.mean(np.square(errors), axis=0)).max() < 1.0  # of 1.6 cm


def test_shades_of_the_background_are_no_gliders():
    """Sand from dark to bright, with a gradient from left to right."""
    random = np.random.default_rng(3)
    shade = np.clip(1.0 + 0.3 * random.standard_normal((240, 320, 1)), 0.2, 2.0) * np.linspace(0.5, 1.0, 320)[:, None]
    image = plain()
    image[..., :3] = np.clip(shade * (150.0, 120.0, 80.0) + random.normal(0.0, 2.0, (240, 320, 3)), 0, 255)
    assert DETECTOR.detect(image) == []
    image[100:110, 200:240, :3] = (150, 130, 20)
    (mark,) = DETECTOR.detect(image)
    assert (mark.u, mark.v) == pytest.approx((220.0, 105.0), abs=0.5)


def test_what_the_border_cuts_is_left_out():
    for rows, columns in (
        (slice(0, 8), slice(50, 90)),
        (slice(50, 60), slice(290, 320)),
        (slice(230, 240), slice(9, 40)),
    ):
        image = plain()
        image[rows, columns, :3] = (220, 180, 30)
        assert DETECTOR.detect(image) == []
    image = plain()
    image[100:110, 100:140, :3] = (220, 180, 30)
    assert len(DETECTOR.detect(image)) == 1
    image[:, :110] = 0
    assert DETECTOR.detect(image) == []


@pytest.mark.parametrize("image", [np.zeros((40, 40, 4)), np.full((1, 1, 4), 255), np.full((3, 500, 4), 200)])
def test_pictures_without_anything_show_nothing(image):
    assert DETECTOR.detect(image.astype(np.uint8)) == []


def test_a_picture_full_of_the_color_shows_no_thing():
    image = plain()
    image[:, ::2, :3] = (220, 180, 30)
    assert DETECTOR.detect(image) == []


def test_sets_of_pixels_are_those_that_touch():
    random = np.random.default_rng(1)
    for share in (0.05, 0.2, 0.4, 0.6):
        pixels = random.random((23, 31)) < share
        rows, columns = np.nonzero(pixels)
        numbers, count = label_components(rows, columns)
        expected = _flooded(pixels)
        assert count == len(set(expected.values()))
        pairs = {
            (expected[place], number) for place, number in zip(zip(rows, columns, strict=True), numbers, strict=True)
        }
        assert len(pairs) == count
    assert label_components(np.empty(0, int), np.empty(0, int))[1] == 0


def _flooded(pixels):
    """The first pixel of the set of each pixel, found one by one."""
    names = {}
    for start in map(tuple, np.argwhere(pixels)):
        waiting = [start]
        while waiting:
            j, i = waiting.pop()
            if (j, i) in names or not (0 <= j < pixels.shape[0] and 0 <= i < pixels.shape[1] and pixels[j, i]):
                continue
            names[j, i] = start
            waiting += [(j + dj, i + di) for dj in (-1, 0, 1) for di in (-1, 0, 1)]
    return names
