"""Marine snow: flakes of the world, seen through any lens."""

import math

import numpy as np
import pytest

from support.pose import Pose
from world import Sun
from world.optics import FisheyeModel, PinholeModel, preset_lens
from world.rendering import Lamp, SceneCamera, ScenePose
from world.rendering.objects.marine_snow import FALL, MarineSnow

PINHOLE = PinholeModel(160, 120, 120.0, 120.0, 80.0, 60.0)
HERE = ScenePose(0.0, 0.0, 4.0, depth=12.0)


def places(flakes, north, east, depth):
    """Flakes that have not begun to fade, m north, east and down in the world, in some order."""
    whole = flakes.subset(flakes.share == 1.0)
    found = whole.points.T + np.array((north, east, depth))
    return found[np.lexsort(found.T)]


def test_the_density_is_that_of_the_option():
    for density in (50.0, 700.0):
        snow = MarineSnow(density, 1)
        count = len(snow.flakes_around(1e4, -3.0, 50.0, 50.0, 9.0).radii)
        assert count == pytest.approx(density * 4 / 3 * math.pi * snow.range**3, rel=0.05)


def test_flakes_stay_in_the_world_and_fall_slowly():
    snow = MarineSnow(200.0, 5)
    before = places(snow.flakes_around(10.0, 20.0, 30.0, 9.0, 0.0), 10.0, 20.0, 30.0)
    after = places(snow.flakes_around(10.3, 19.8, 30.1, 8.9, 60.0), 10.3, 19.8, 30.1) - (0.0, 0.0, 60.0 * FALL)
    known = {tuple(place) for place in before.round(6)}
    both = sum(tuple(place) in known for place in after.round(6))
    assert both > 0.75 * len(after)
    assert (
        not set(map(tuple, places(MarineSnow(200.0, 6).flakes_around(10.0, 20.0, 30.0, 9.0, 0.0), 10.0, 20.0, 30.0)))
        & known
    )


def test_flakes_are_in_the_water():
    down = MarineSnow(500.0).flakes_around(0.0, 0.0, 0.5, 1.0, 0.0).points[2]
    assert -0.5 < down.min() < -0.4
    assert 0.9 < down.max() < 1.0


def seen(camera, bare, pose):
    """Row and column of the middle of the brightest flake in a picture."""
    changed = camera.take_picture(pose).astype(int) - bare.take_picture(pose)
    light = np.clip(changed[..., :3].sum(axis=2), 0, None)
    j, i = np.unravel_index(light.argmax(), light.shape)
    part = light[j - 2 : j + 3, i - 2 : i + 3]
    rows, columns = np.mgrid[j - 2 : j + 3, i - 2 : i + 3] + 0.5
    return float((part * columns).sum() / part.sum()), float((part * rows).sum() / part.sum())


@pytest.mark.heavy
@pytest.mark.parametrize(
    "optics",
    [
        PINHOLE,
        FisheyeModel.from_lens(preset_lens("equidistant", math.pi), 400),
        FisheyeModel.from_lens(preset_lens("equisolid", math.radians(200)), 400),
    ],
    ids=["pinhole", "180°", "200°"],
)
def test_all_lenses_see_a_flake_where_it_is(optics):
    night = {"sun": Sun(elevation=math.radians(-60.0)), "lamps": (Lamp(Pose(theta=-math.pi / 2, z=0.3), 9e3, 2.0),)}
    bare, camera = (SceneCamera(optics, 700, 6, "bilinear", marine_snow=density, **night) for density in (0.0, 8.0))
    u, v = seen(camera, bare, HERE)
    flakes = MarineSnow(8.0).flakes_around(0.0, 0.0, HERE.depth, HERE.height, 0.0)
    x, y, z = flakes.points
    pixels, valid = optics.project(np.stack((y, -x, z), axis=1))  # the camera looks down, its top to the bow
    assert np.hypot(*(pixels[valid] - (u, v)).T).min() < 1.0


def test_lamps_make_flakes_bright():
    night = Sun(elevation=math.radians(-60.0))
    lamp = Lamp(Pose(x=0.2, theta=math.radians(-90.0)), 3000.0)
    change = {}
    for lamps in ((), (lamp,)):
        bare, snowy = (
            SceneCamera(PINHOLE, 128, sun=night, lamps=lamps, marine_snow=s).take_picture(HERE) for s in (0.0, 2000.0)
        )
        change[lamps] = int((snowy.astype(int) - bare).max())
    assert change[()] < 5
    assert change[(lamp,)] > 60


def test_without_snow_and_above_the_sea_nothing_changes():
    for kind in ("Seabed", "Sea Surface"):
        bare, snowy = (SceneCamera(PINHOLE, 64, scene=kind, marine_snow=s).take_picture(HERE) for s in (0.0, 2000.0))
        assert np.array_equal(bare, snowy) == (kind == "Sea Surface")


def test_labels_do_not_know_flakes():
    bare, snowy = (SceneCamera(PINHOLE, 64, marine_snow=s).labels(HERE) for s in (0.0, 2000.0))
    np.testing.assert_array_equal(bare.distance, snowy.distance)
    np.testing.assert_array_equal(bare.instances, snowy.instances)
