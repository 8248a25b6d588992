"""The sensor behind the lens: photon transfer, vignetting, motion blur and the rolling shutter."""

import functools
import math
from dataclasses import replace

import numpy as np
import pytest

from world.optics import FisheyeModel, PinholeModel, preset_lens
from world.rendering import Exposure, SceneCamera, ScenePose, Shutter, frame_random
from world.rendering.image_sensor import squared_radius, to_linear_light

HERE = ScenePose(3.0, -2.0, 4.0, 6.0, roll=0.1)


@functools.cache
def pinhole(width=160, height=120):
    return SceneCamera(PinholeModel(width, height, 120.0, 120.0, width / 2, height / 2), 0, 6, visibility=100.0)


def gray(level, size=400, alpha=255):
    picture = np.full((size, size, 4), level, dtype=np.uint8)
    picture[..., 3] = alpha
    return picture


@pytest.mark.parametrize("level", [40, 90, 140, 190])
@pytest.mark.parametrize(("gain", "read"), [(1.0, 0.0), (1.0, 150.0), (8.0, 12.0)])
def test_noise_follows_photon_transfer(level, gain, read):
    """Variance of the light is gain * mean / full well + (gain * read / full well)²; the mean stays."""
    well = 20000.0
    found = to_linear_light(
        Exposure(gain=gain, full_well=well, read_noise=read).add_vignetting_and_noise(
            gray(level), frame_random(1, "a", 0)
        )
    )
    meant = ((level + 0.5) / 255) ** 2
    variance = gain * meant / well + (gain * read / well) ** 2
    rounding = (2 * math.sqrt(meant) / 255) ** 2 / 12  # of counts, in light
    assert found.mean() == pytest.approx(meant, abs=5 * math.sqrt(variance / found.size) + 0.15 * rounding + 2e-5)
    assert found.var() == pytest.approx(variance + rounding, rel=0.03)


def test_no_colour_tells_of_another():
    red, green, blue = np.moveaxis(
        to_linear_light(Exposure(full_well=500.0).add_vignetting_and_noise(gray(120), frame_random(1, "a", 0))), -1, 0
    )
    for one, other in ((red, green), (green, blue), (red[1:], red[:-1])):
        assert abs(np.corrcoef(one.ravel(), other.ravel())[0, 1]) < 4 / math.sqrt(one.size)


def test_a_perfect_sensor_leaves_a_picture_as_it_is():
    picture = np.random.default_rng(4).integers(0, 256, (30, 40, 4), dtype=np.uint8)
    assert Exposure().add_vignetting_and_noise(picture, frame_random(0, "", 0)) is picture
    camera = pinhole()
    taken = Shutter(camera, Exposure()).take_picture([HERE], (), frame_random(0, "", 0))
    np.testing.assert_array_equal(taken, camera.take_picture(HERE, ()))


def test_noise_depends_on_seed_camera_and_frame_alone():
    exposure, pictures = Exposure(full_well=1000.0), []
    for key in ((1, "a", 5), (1, "a", 5), (1, "a", 6), (1, "b", 5), (2, "a", 5)):
        pictures.append(exposure.add_vignetting_and_noise(gray(100, 20), frame_random(*key)))
    np.testing.assert_array_equal(pictures[0], pictures[1])
    assert all((pictures[0] != other).any() for other in pictures[2:])


def test_vignetting_is_symmetric_and_takes_its_share_of_the_corners():
    picture = gray(200, 101)[:75]
    found = Exposure(vignetting=0.6).add_vignetting_and_noise(picture, frame_random(0, "", 0))
    for mirrored in (found[::-1], found[:, ::-1], found[::-1, ::-1]):
        np.testing.assert_array_equal(mirrored, found)
    light = to_linear_light(found)[..., 0] / to_linear_light(picture)[..., 0]
    assert light[37, 50] == pytest.approx(1.0, abs=0.01)
    assert light[0, 0] == pytest.approx(0.4, abs=0.01)
    np.testing.assert_allclose(light, 1 - 0.6 * squared_radius(75, 101), atol=0.012)


def test_what_is_void_stays_void():
    picture = gray(90, 16)
    picture[:4] = 0
    found = Exposure(full_well=50.0, read_noise=9.0, vignetting=0.3).add_vignetting_and_noise(
        picture, frame_random(3, "a", 1)
    )
    assert not found[:4].any()
    assert (found[4:, :, 3] == 255).all()


def test_rows_are_exposed_around_the_instant_of_the_picture():
    exposure = Exposure(time=0.01, samples=5, readout=0.03)
    times = exposure.row_times(120)
    assert times[0] == pytest.approx(-0.015 + 0.015 / 120)
    np.testing.assert_allclose(times, -times[::-1], atol=1e-15)
    instants = exposure.sample_times(4).reshape(4, 5)
    np.testing.assert_allclose(instants.mean(axis=1), exposure.row_times(4), atol=1e-15)
    np.testing.assert_allclose(np.ptp(instants, axis=1), 0.01 * 4 / 5)


def test_motion_smears_along_itself():
    """Over the ground at 1 m/s, 8 px in the time of exposure: contrast along the motion is lost, across it is kept."""
    camera, speed, focal = pinhole(), 1.0, 120.0
    seconds = 8 / focal * HERE.height / speed
    shutter = Shutter(camera, Exposure(time=seconds, samples=9))
    level = replace(HERE, roll=0.0)
    path = [replace(level, north=level.north + speed * dt) for dt in shutter.sample_times]
    sharp, smeared = (
        to_linear_light(p)[..., 1]
        for p in (camera.take_picture(level, ()), shutter.take_picture(path, (), frame_random(0, "", 0)))
    )
    along, across = (np.diff(smeared, axis=axis).std() / np.diff(sharp, axis=axis).std() for axis in (0, 1))
    assert along < 0.35
    assert across > 1.8 * along
    assert smeared.mean() == pytest.approx(sharp.mean(), rel=0.01)


def test_a_shutter_that_nothing_moves_before_takes_the_same_picture():
    camera = pinhole()
    shutter = Shutter(camera, Exposure(readout=0.02), bands=7)
    taken = shutter.take_picture([HERE] * 7, (), frame_random(0, "", 0))
    np.testing.assert_array_equal(taken, camera.take_picture(HERE, ()))
    lens = FisheyeModel.from_lens(preset_lens("equidistant", math.pi), 90)
    fisheye = SceneCamera(lens, 64, visibility=50.0, interpolation="bilinear")
    taken = Shutter(fisheye, Exposure(readout=0.02), bands=4).take_picture([HERE] * 4, (), frame_random(0, "", 0))
    np.testing.assert_array_equal(taken, fisheye.take_picture(HERE, ()))


@pytest.mark.heavy
@pytest.mark.parametrize(("bands", "most"), [(8, 5 / 8), (30, 5 / 30)])
def test_each_row_of_a_rolling_shutter_has_its_own_pose(bands, most):
    """A turn of 10 px in a readout: each row is that of the global shutter at its time, to half a band of motion."""
    camera, rate = pinhole(), 10 / 120.0 / 0.02
    shutter = Shutter(camera, Exposure(readout=0.02), bands=bands)

    def at(seconds):
        return replace(HERE, roll=rate * seconds)

    rolling = shutter.take_picture([at(dt) for dt in shutter.sample_times], (), frame_random(0, "", 0))
    height = camera.optics.height
    worst = 0.0
    for row, time in enumerate(shutter.exposure.row_times(height)):
        band = row * bands // height
        assert abs(shutter.sample_times[band] - time) * rate * 120.0 <= most + 1e-9
        np.testing.assert_array_equal(rolling[row], camera.take_picture(at(shutter.sample_times[band]), ())[row])
        worst = max(worst, abs(shutter.sample_times[band] - time))
    assert worst <= 0.02 / (2 * bands)


@pytest.mark.parametrize(
    ("figures", "text"),
    [
        ({"time": -1.0}, "time = -1"),
        ({"time": math.nan}, "time = nan"),
        ({"gain": 0.5}, "gain = 0.5"),
        ({"full_well": math.inf}, "full_well = inf"),
        ({"read_noise": 3.0}, "needs a full_well"),
        ({"vignetting": 1.5}, "vignetting = 1.5"),
        ({"samples": 0}, "samples = 0"),
        ({"readout": -0.1}, "readout = -0.1"),
    ],
)
def test_impossible_sensors_are_refused(figures, text):
    with pytest.raises(ValueError, match=text):
        Exposure(**figures)


def test_a_shutter_wants_a_standpoint_for_each_instant():
    with pytest.raises(ValueError, match="1 standpoints are not 1 times 3"):
        Shutter(pinhole(), Exposure(time=0.1, samples=3)).take_picture([HERE], (), frame_random(0, "", 0))
