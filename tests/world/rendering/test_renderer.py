"""Contents of the rendered pictures, and their places."""

import functools
import math
from dataclasses import replace

import numpy as np
import pytest

from world.optics import FisheyeModel, preset_lens
from world.rendering import SceneCamera, ScenePose
from world.rendering.light.scene_colors import KOSCHMIEDER_CONSTANT, green_water
from world.rendering.renderer import optical_to_ned_rotation

DIVING = ScenePose(north=3.0, east=-2.0, height=4.0, depth=6.0)
FLYING = ScenePose(north=3.0, east=-2.0, height=8.0)
SKY = 180  # red of the sky next to the horizon; the sea has less


@functools.cache
def fisheye(scene="Seabed", fov=180.0, size=320, **options):
    optics = FisheyeModel.from_lens(preset_lens("equidistant", math.radians(fov)), size)
    return SceneCamera(optics, face_width=192, scene=scene, **options)


def centroid(difference):
    """The centroid of the pixels that a glider changes, weighted by the change."""
    i, j = np.meshgrid(np.arange(difference.shape[1]) + 0.5, np.arange(difference.shape[0]) + 0.5)
    return np.array([np.sum(i * difference), np.sum(j * difference)]) / np.sum(difference)


@pytest.mark.parametrize(
    "pose",
    [
        DIVING,
        replace(DIVING, yaw=2.0),
        replace(DIVING, roll=0.35, pitch=-0.2, yaw=-1.0),
        replace(DIVING, pitch=1.2),
        replace(DIVING, roll=-1.9, yaw=0.3),
        replace(DIVING, height=2.0, north=0.0),
        FLYING,
        replace(FLYING, roll=0.4, pitch=0.3, yaw=2.5),
    ],
)
@pytest.mark.parametrize("mug", [(4.0, -1.7), (1.0, 1.0)])
def test_a_glider_appears_where_it_projects_to(pose, mug):
    scene = "Seabed" if pose.depth else "Sea Surface"
    with_mug, without = (fisheye(scene, 220, glider_positions=mugs, visibility=200.0) for mugs in ((mug,), ()))
    down = pose.height
    expected = with_mug.optics.project(
        np.array([mug[0] - pose.north, mug[1] - pose.east, down]) @ optical_to_ned_rotation(pose)
    )[0]
    difference = np.abs(with_mug.take_picture(pose).astype(float) - without.take_picture(pose)).sum(axis=-1)
    assert difference.max() > 100
    assert np.linalg.norm(centroid(difference) - expected) < 1.0


def test_gliders_are_yellow_and_the_nearer_one_covers_the_farther():
    pose = replace(DIVING, height=1.0, north=0.0, east=0.0, roll=math.radians(60))
    pictures = [
        fisheye(glider_positions=mugs).take_picture(pose)
        for mugs in (((0.0, 0.5), (0.0, 2.0)), ((0.0, 2.0), (0.0, 0.5)))
    ]
    np.testing.assert_array_equal(*pictures)
    red, green, blue = np.moveaxis(pictures[0][..., :3].astype(int), -1, 0)
    assert np.sum((red > 150) & (green > 120) & (blue < 100)) > 30


def test_the_horizon_is_straight_in_space():
    pose = replace(FLYING, roll=0.5, pitch=0.2, yaw=1.0)
    fisheye_camera = fisheye("Sea Surface", 220)
    rays, inside = fisheye_camera.optics.pixel_rays()
    down = (rays @ optical_to_ned_rotation(pose).T)[..., 2]
    bright = fisheye_camera.take_picture(pose)[..., 0] > SKY
    near = inside & (np.abs(down) > 0.012) & (np.abs(down) < 0.06)
    assert near.sum() > 500
    np.testing.assert_array_equal(bright[near], (down < 0)[near])


def test_the_top_of_the_image_looks_to_the_bow():
    """Bow up: the sky comes in from the top; starboard up: from the right."""
    top = fisheye("Sea Surface").take_picture(replace(FLYING, pitch=0.4))[..., 0] > SKY
    right = fisheye("Sea Surface").take_picture(replace(FLYING, roll=-0.4))[..., 0] > SKY
    assert top[:160].sum() > 20 * top[160:].sum()
    assert right[:, 160:].sum() > 20 * right[:, :160].sum()


def test_the_view_moves_with_the_vehicle():
    """Moving by the footprint of ten pixels shifts the middle of the picture by ten pixels."""
    camera_below = fisheye(size=256, visibility=1000.0)
    step = 10 * math.pi / 256 * DIVING.height
    here, there = (camera_below.take_picture(replace(DIVING, north=n))[..., 1].astype(float) for n in (0.0, step))
    middle = slice(108, 148)
    errors = [np.abs(there[middle, middle] - here[108 - s : 148 - s, middle]).mean() for s in (-10, -9, 0, 9, 10, 11)]
    assert np.argmin(errors) == 4


def test_distance_swallows_contrast():
    near, far = (fisheye().take_picture(replace(DIVING, height=h))[140:180, 140:180, 1] for h in (2.0, 19.0))
    assert near.std() > 4 * far.std()
    murky = fisheye(visibility=2.0).take_picture(replace(DIVING, height=8.0))
    assert murky[150:170, 150:170, 1].std() < 1


def test_visibility_is_where_two_percent_of_the_contrast_are_left():
    assert green_water(15.0).transmission(np.array([[15.0]]))[1, 0, 0] == pytest.approx(0.02, rel=1e-3)
    assert math.exp(-KOSCHMIEDER_CONSTANT) == pytest.approx(0.02, rel=1e-3)


def test_snells_window_is_bright_inside_half_of_97_degrees():
    """Upside down at 3 m depth: the sky within 48.3° of the zenith, and the reflected deep around it."""
    picture = fisheye(visibility=100.0).take_picture(replace(DIVING, depth=3.0, roll=math.pi))
    radius = np.hypot(*np.meshgrid(np.arange(320) - 159.5, np.arange(320) - 159.5)) * 180 / 320
    brightness = picture[..., 1].astype(float)
    inside, outside = brightness[radius < 35], brightness[(radius > 62) & (radius < 80)]
    assert np.percentile(inside, 5) > np.percentile(outside, 95) + 30


def test_no_seam_between_faces():
    """Across the edge of the face below, neighboring pixels differ no more than elsewhere."""
    picture = fisheye("Sea Surface", size=512).take_picture(FLYING)[..., 1].astype(int)
    steps = np.abs(np.diff(picture[:, 246:266], axis=0)).mean(axis=1)
    assert steps[126:130].max() < 2.5 * np.median(steps[100:160])


@pytest.mark.parametrize(
    "pose",
    [
        replace(FLYING, height=1e4),
        replace(DIVING, height=1e-3),
        replace(DIVING, depth=-1.0),
        replace(DIVING, depth=1.1e4),
    ],
)
@pytest.mark.parametrize("scene", ["Seabed", "Sea Surface"])
@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_extreme_heights_and_depths(scene, pose):
    for visibility in (0.0, 0.1):
        picture = fisheye(scene, 220, size=96, visibility=visibility).take_picture(replace(pose, roll=0.3))
        assert picture[48, :, 3].all()


@pytest.mark.parametrize("scene", ["Seabed", "Sea Surface"])
def test_pictures_depend_on_pose_and_seed_alone(scene):
    pose = replace(DIVING, roll=0.2, time=12.0)
    first = fisheye(scene, seed=3).take_picture(pose)
    fisheye.cache_clear()
    np.testing.assert_array_equal(fisheye(scene, seed=3).take_picture(pose), first)
    assert (fisheye(scene, seed=4).take_picture(pose) != first).any()


def test_waves_move_and_the_seabed_does_not():
    below, above = fisheye(), fisheye("Sea Surface")
    np.testing.assert_array_equal(*(below.take_picture(replace(DIVING, time=t)) for t in (0.0, 5.0)))
    assert (above.take_picture(FLYING) != above.take_picture(replace(FLYING, time=5.0))).any()
