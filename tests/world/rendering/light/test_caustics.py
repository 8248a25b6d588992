"""Caustics: light that waves gather on the bottom."""

import math

import numpy as np
import pytest

from world import Sun
from world.optics import PinholeModel
from world.rendering import Caustics, SceneCamera, ScenePose, green_water
from world.sea import SeaState

OPTICS = PinholeModel(160, 120, 100.0, 100.0, 80.0, 60.0)
DEPTHS = (0.02, 0.3, 1.0, 3.0, 8.0, 20.0)


def caustics(strength=1.0, height=0.88, elevation=90.0, visibility=20.0, seed=1):
    return Caustics(strength, SeaState(height), Sun(0.0, math.radians(elevation)), green_water(visibility), seed)


@pytest.mark.heavy
def test_the_light_is_gathered_and_not_made():
    north, east = np.random.default_rng(1).uniform(-200.0, 200.0, (2, 100000))
    for depth in DEPTHS:
        light = caustics().intensity(north, east, depth, 7.0)
        assert light.mean() == pytest.approx(1.0, abs=0.01)
        assert light.std() == pytest.approx(caustics().contrast(depth), rel=0.15)
        assert light.min() >= 0.0
    assert caustics().intensity(north, east, 1.0, 7.0).max() > 3.0


def test_they_are_fixed_to_places_and_times():
    one, other = caustics(), caustics()
    north, east = np.random.default_rng(1).uniform(-5.0, 5.0, (2, 500))
    np.testing.assert_array_equal(one.intensity(north, east, 1.0, 3.0), other.intensity(north, east, 1.0, 3.0))
    assert np.corrcoef(one.intensity(north, east, 1.0, 3.0), one.intensity(north, east, 1.0, 3.02))[0, 1] > 0.7
    assert abs(np.corrcoef(one.intensity(north, east, 1.0, 3.0), one.intensity(north, east, 1.0, 9.0))[0, 1]) < 0.2
    assert (
        abs(np.corrcoef(one.intensity(north, east, 1.0, 3.0), caustics(seed=2).intensity(north, east, 1.0, 3.0))[0, 1])
        < 0.2
    )


@pytest.mark.heavy
def test_they_fade_with_depth_and_need_sun_and_waves():
    contrasts = [float(caustics().contrast(depth)) for depth in DEPTHS]
    assert max(contrasts) == contrasts[2]
    assert 0.3 < contrasts[2] < 0.7
    assert contrasts[0] < 0.1
    assert contrasts[4] < 0.1 > 4 * contrasts[5]
    assert caustics(visibility=3.0).contrast(3.0) < 0.3 * caustics().contrast(3.0)
    assert caustics(strength=0.5).contrast(1.0) == pytest.approx(0.5 * caustics().contrast(1.0))
    assert caustics(elevation=5.0).contrast(1.0) < 0.5 * caustics().contrast(1.0)
    assert caustics(elevation=-5.0).contrast(1.0) == 0.0 == caustics(height=0.0).contrast(1.0)
    assert caustics(height=3.0).contrast(0.3) > caustics().contrast(0.3)


@pytest.mark.heavy
def test_a_picture_shows_the_light_of_its_places():
    """What a camera sees more than without caustics is the light of the place that it sees, wherever it is."""
    for place in ((0.0, 0.0), (1.3, -40.2)):
        here = ScenePose(*place, 2.0, depth=0.0, yaw=0.5, time=4.0)
        bare, lit = (SceneCamera(OPTICS, 200, 6, "bilinear", caustics=s, seed=1).take_picture(here) for s in (0.0, 1.0))
        ratio = (lit[..., 1].astype(float) / bare[..., 1]) ** 2
        rays, _ = OPTICS.pixel_rays()
        ahead, right = -2.0 * rays[..., 1] / rays[..., 2], 2.0 * rays[..., 0] / rays[..., 2]
        north, east = (
            place[0] + ahead * math.cos(0.5) - right * math.sin(0.5),
            place[1] + ahead * math.sin(0.5) + right * math.cos(0.5),
        )
        light = caustics().intensity(north, east, 2.0, 4.0)
        usual = lit[..., 1] < 255
        assert np.corrcoef(ratio[usual], light[usual])[0, 1] > 0.8


def test_they_are_off_by_default_and_not_in_the_air():
    here = ScenePose(0.0, 0.0, 2.0, depth=1.0)
    for scene in ("Seabed", "Sea Surface"):
        bare, off, lit = (
            SceneCamera(OPTICS, 64, scene=scene, **more).take_picture(here)
            for more in ({}, {"caustics": 0.0}, {"caustics": 1.0})
        )
        np.testing.assert_array_equal(bare, off)
        assert np.array_equal(bare, lit) == (scene == "Sea Surface")
        assert (lit[..., 3] == bare[..., 3]).all()
