"""Labels of a rolling shutter are those of the picture: each row from where the vehicle is then."""

import math
from dataclasses import replace

import numpy as np
import pytest

from world.optics import FisheyeModel, PinholeModel, preset_lens
from world.rendering import Exposure, Glider, SceneCamera, ScenePose, Shutter, frame_random

HERE = ScenePose(0.0, 0.0, 4.0, 6.0, roll=0.05)
GLIDERS = (Glider(0.2, 0.3, heading=0.4), Glider(-0.9, -1.0, heading=2.0, length=1.5, diameter=0.4))
FAR = (Glider(4.0, 1.0, heading=0.4, length=1.5, diameter=0.4), Glider(-4.0, -1.0, 0.0, 2.0, 1.5, 0.4))
SEEN = {"pinhole": GLIDERS, "fisheye": FAR}
READOUT = 0.1
CAMERAS = {
    "pinhole": PinholeModel(320, 240, 260.0, 260.0, 160.0, 120.0),
    "fisheye": FisheyeModel.from_lens(preset_lens("equidistant", math.pi), 480),
}


def moved(seconds, rate=1.2, speed=1.5):
    """A vehicle that turns, rolls and goes ahead."""
    return replace(HERE, north=speed * seconds, yaw=rate * seconds, roll=HERE.roll + 0.5 * rate * seconds)


def overlap(one, other):
    return np.count_nonzero(one & other) / np.count_nonzero(one | other)


def shutter_of(name, samples=1):
    # The faces are far finer than the picture, so that the nearest pixel of a face is the right one.
    camera = SceneCamera(CAMERAS[name], 1024, 6, visibility=200.0)
    return Shutter(camera, Exposure(readout=READOUT, time=0.002, samples=samples), bands=24)


@pytest.mark.heavy
@pytest.mark.parametrize("name", CAMERAS)
def test_masks_are_those_of_the_objects_in_the_rolled_picture(name):
    shutter, gliders = shutter_of(name), SEEN[name]
    path = [moved(dt) for dt in shutter.sample_times]
    shown, bare = (shutter.take_picture(path, some, frame_random(0, "", 0)) for some in (gliders, ()))
    drawn = np.any(shown != bare, axis=-1)
    found = shutter.labels([moved(dt) for dt in shutter.band_times], gliders)
    assert overlap(found.instances > 0, drawn) >= 0.95
    assert overlap(shutter.camera.labels(HERE, gliders).instances > 0, drawn) < 0.85
    for number, box in enumerate(found.boxes, start=1):
        rows, columns = np.nonzero(found.instances == number)
        assert box.instance == number
        assert box.box == (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1)
        assert (box.area, box.whole_area, box.cut_share) == (rows.size, rows.size, 0.0)


def test_depth_is_that_of_each_row():
    """Straight down over level ground, a vehicle that sinks has less below it from row to row."""
    shutter = shutter_of("pinhole")
    sinking = [ScenePose(0.0, 0.0, 4.0 - 2.0 * dt, 6.0 + 2.0 * dt) for dt in shutter.band_times]
    found = shutter.labels(sinking, ())
    each = [pose.height for pose in sinking for _ in range(240 // 24)]
    np.testing.assert_allclose(found.depth, np.repeat(each, 320).reshape(240, 320), rtol=1e-6)


@pytest.mark.heavy
def test_still_labels_are_those_of_one_instant():
    shutter = shutter_of("pinhole")
    edge = (*GLIDERS, Glider(-1.9, 0.0, heading=0.0))
    then = replace(HERE, north=0.3, yaw=0.02)
    found = shutter.labels([HERE] * 24, edge, ([then] * 24, edge))
    wanted = shutter.camera.labels(HERE, edge, (then, edge))
    for field in ("distance", "depth", "kinds", "instances"):
        np.testing.assert_array_equal(getattr(found, field), getattr(wanted, field))
    np.testing.assert_allclose(found.flow, wanted.flow, atol=1e-3)
    for box, other in zip(found.boxes, wanted.boxes, strict=True):
        assert box[:-1] == other[:-1]
        assert box.cut_share == pytest.approx(other.cut_share, abs=1e-9)
    assert wanted.boxes[-1].cut_share > 0.05


@pytest.mark.heavy
def test_flow_ends_in_the_row_that_is_taken_there():
    """Where flow leads, the next picture shows the same object."""
    shutter = shutter_of("pinhole")
    first = [moved(dt) for dt in shutter.band_times]
    second = [moved(0.2 + dt) for dt in shutter.band_times]
    found = shutter.labels(first, GLIDERS, (second, GLIDERS))
    after = shutter.labels(second, GLIDERS)
    rows, columns = np.nonzero(found.instances == 1)
    ends = found.flow[rows, columns] + np.stack((columns, rows), axis=-1) + 0.5
    x, y = np.floor(ends).astype(int).T
    inside = (x >= 0) & (x < 320) & (y >= 0) & (y < 240)
    assert inside.sum() > 100
    assert np.mean(after.instances[y[inside], x[inside]] == 1) > 0.95


def test_a_wrong_number_of_standpoints_is_refused():
    with pytest.raises(ValueError, match="3 standpoints are not 24"):
        shutter_of("pinhole").labels([HERE] * 3, GLIDERS)
