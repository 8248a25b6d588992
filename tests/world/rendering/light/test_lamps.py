"""Lamps of a vehicle, and night."""

import functools
import math
from itertools import pairwise

import numpy as np
import pytest

from support.pose import DOWN, Pose
from world import Sun, WorldError, read_world
from world.optics import PinholeModel
from world.rendering import Lamp, SceneCamera, ScenePose
from world.rendering.light.lamps import body_illuminance, face_backscatter, ground_illuminance, lamp_beams

CLEAR, MURKY = np.zeros(3), np.array([0.4, 0.2, 0.3])
NIGHT = Sun(0.0, math.radians(-30.0))
HERE = ScenePose(0.0, 0.0, 2.5, 10.0)


@functools.cache
def camera(lamps=(), sun=NIGHT):
    return SceneCamera(PinholeModel(120, 120, 60.0, 60.0, 60.0, 60.0), 120, 6, sun=sun, lamps=lamps)


def straight_down(height):
    return np.array([[0.0], [0.0], [height]])


@pytest.mark.parametrize("width", [20.0, 80.0, 150.0])
def test_all_of_the_flux_is_in_the_beam(width):
    lamp = Lamp(DOWN, 1000.0, math.radians(width))
    angle = (np.arange(20000) + 0.5) * math.pi / 20000
    rings = math.tau * np.sin(angle) * math.pi / 20000
    assert np.sum(lamp.candela * lamp.relative_intensity(np.cos(angle)) * rings) == pytest.approx(1000.0, rel=1e-4)
    assert lamp.relative_intensity(np.cos(math.radians(width / 2))) == pytest.approx(0.5)


def test_light_falls_with_the_square_the_cosine_and_the_water():
    lamp = Lamp(DOWN, 2000.0, math.pi)
    (beam,) = lamp_beams((lamp,), Pose(), Pose())
    near, far = (ground_illuminance((beam,), straight_down(h), CLEAR)[1, 0] for h in (1.5, 3.0))
    assert near == pytest.approx(lamp.candela / 1.5**2)
    assert near == pytest.approx(4 * far)
    aside = ground_illuminance((beam,), np.array([[1.5], [0.0], [1.5]]), CLEAR)[1, 0]
    assert aside == pytest.approx(near / 2 * math.cos(math.pi / 4) * lamp.relative_intensity(np.cos(math.pi / 4)))
    through = ground_illuminance((beam,), straight_down(1.5), MURKY)[:, 0]
    np.testing.assert_allclose(through, near * np.exp(-1.5 * MURKY), rtol=1e-6)
    np.testing.assert_allclose(body_illuminance((beam,), (0.0, 0.0, 1.5), MURKY), through, rtol=1e-6)


def test_a_lamp_stays_where_it_is_on_the_vehicle():
    """It shines ahead, 0.5 m to starboard; the vehicle looks east, and the camera is 0.2 m below its middle."""
    vehicle, eye = Pose(7.0, 8.0, 9.0, psi=math.pi / 2), Pose(z=0.2, theta=-math.pi / 2)
    (beam,) = lamp_beams((Lamp(Pose(y=0.5)),), vehicle, eye)
    np.testing.assert_allclose(beam.position, (-0.5, 0.0, -0.2), atol=1e-12)
    np.testing.assert_allclose(beam.axis, (0.0, 1.0, 0.0), atol=1e-12)


def test_the_water_throws_light_back_as_the_integral_says():
    """Along the axis of a face that looks down, 2 m over the ground, for a lamp beside the camera."""
    lamp = Lamp(DOWN._replace(x=0.4), 1500.0, math.radians(90.0))
    (beam,) = lamp_beams((lamp,), Pose(), Pose())
    backward = np.array([0.01, 0.02, 0.03])
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    found = face_backscatter((beam,), turn, 63, 2.0, MURKY, backward)
    s = 0.05 + (np.arange(40000) + 0.5) * 1.95 / 40000
    away = np.hypot(s, 0.4)
    lux = lamp.candela * lamp.relative_intensity(s / away) / away**2
    for color in range(3):
        glare = np.sum(lux * np.exp(-MURKY[color] * (s + away))) * 1.95 / 40000
        assert found[color, 31, 31] == pytest.approx(0.5 * backward[color] * glare, rel=0.02)
    assert np.argmax(found[1, :, 31]) < 31  # toward the bow, where the lamp is


def test_a_night_without_lamps_is_black_and_with_them_it_is_not():
    dark = camera().take_picture(HERE)[..., :3]
    assert dark.max() < 12
    lit = camera((Lamp(DOWN._replace(x=-0.6), 3000.0, math.radians(60.0)),)).take_picture(HERE)[..., :3]
    assert lit[60, 60].mean() > 60
    assert lit[60, 60].mean() > 2 * lit[2, 2].mean()
    assert (lit.max(axis=-1) == 255).mean() < 0.01


def test_what_one_lamp_does_not_light_stays_dark():
    aside = Lamp(Pose(phi=0.0, theta=-math.pi / 4, psi=math.pi / 2), 3000.0, math.radians(30.0))
    picture = camera((aside,)).take_picture(HERE)[..., :3].mean(axis=-1)
    assert picture[:, 100:].mean() > 5 * picture[:, :30].mean()


def test_a_lamp_without_power_changes_nothing_by_day():
    """The slow way, pixel by pixel, finds what the palettes say."""
    by_day = Sun(0.0, 1.0)
    plain, lit = (camera(lamps, by_day).take_picture(HERE).astype(int) for lamps in ((), (Lamp(DOWN, 0.0),)))
    difference = np.abs(plain - lit)
    assert np.percentile(difference, 99) <= 1
    assert difference.max() <= 4


def test_by_day_a_lamp_matters_only_in_the_deep():
    lamp = (Lamp(DOWN, 3000.0, math.radians(60.0)),)
    shallow, deep = (
        np.abs(camera(lamp, Sun()).take_picture(pose).astype(int) - camera((), Sun()).take_picture(pose)).max()
        for pose in (HERE, ScenePose(0.0, 0.0, 2.5, 200.0))
    )
    assert shallow < 10
    assert deep > 30


def test_dusk_comes_step_by_step():
    lux = [Sun(0.0, math.radians(e)).lux for e in (90, 30, 0, -6, -9, -10, -40)]
    assert lux[0] == lux[1] == lux[2]
    assert all(one > other for one, other in pairwise(lux[2:6]))
    assert lux[3] == pytest.approx(3.3, rel=0.02)  # the end of civil twilight
    above = [
        SceneCamera(
            PinholeModel(40, 40, 20.0, 20.0, 20.0, 20.0), 40, 6, scene="Sea Surface", sun=Sun(0.0, math.radians(e))
        )
        for e in (90, -40)
    ]
    day, night = (one.take_picture(ScenePose(0.0, 0.0, 10.0))[..., :3].mean() for one in above)
    assert day > 2 * night


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: Lamp(DOWN, -1.0), "flux = -1 lm"),
        (lambda: Lamp(DOWN, math.nan), "flux = nan lm"),
        (lambda: Lamp(DOWN, width=0.0), "a beam of 0°"),
        (lambda: Lamp(Pose(x=math.inf)), "mount of a lamp is not finite"),
        (lambda: Sun(0.0, 2.0), "the sun has no elevation of 114"),
        (lambda: Sun(math.nan, 1.0), "the sun has no"),
    ],
)
def test_impossible_lights_are_refused(make, text):
    with pytest.raises(ValueError, match=text):
        make()


def test_a_profile_says_how_far_below_the_horizon_the_sun_is():
    def value(elevation):
        return lambda section, option: elevation if (section, option) == ("World", "Sun Elevation") else ""

    assert read_world(value("-12")).sun.elevation == pytest.approx(math.radians(-12.0))
    with pytest.raises(WorldError, match=r"\[World\] Sun Elevation = -91"):
        read_world(value("-91"))
