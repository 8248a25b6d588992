"""The whole way from rendered pictures to tracks, 10 m above the ground, with the noise of a camera."""

import math

import numpy as np
import pytest

from support.pose import DOWN
from tests.repeats import repeat
from world.detection import (
    BlobDetector,
    DetectionAccuracy,
    PoseOverPlane,
    Tracker,
    TrackerSettings,
    fits_size,
    project_to_plane,
)
from world.optics import PinholeModel
from world.rendering import Glider, SceneCamera, ScenePose, optical_to_body_transform

HEIGHT = 10.0
MOUNT = optical_to_body_transform(DOWN)
EXACT = DetectionAccuracy(attitude=0.0, heading=0.0, height=0.0, slope=0.0, place=0.0)


def optics(width):
    """65° wide, four to three."""
    focal = width / 2 / math.tan(math.radians(65.0) / 2)
    return PinholeModel(width, width * 3 // 4, focal, focal, width / 2, width * 3 / 8)


def contrast(camera):
    """How far the mean color of a glider is from what it covers, of 255."""
    here = ScenePose(0.0, 0.0, HEIGHT, depth=5.0)
    shown, bare = (camera.take_picture(here, gliders)[..., :3].astype(float) for gliders in ([Glider(0.0, 0.0)], []))
    apart = shown - bare
    return float(np.linalg.norm(apart[np.abs(apart).sum(axis=-1) > 20.0].mean(axis=0)))


def sail(pictures, width, period=0.2, speed=1.0):
    """A vehicle sails north over gliders, every 6 m one, with the true pose.

    Returns how often one was found that was whole in the picture, the errors of tracks (m), and the number of tracks
    that are of no glider.
    """
    model = optics(width)
    camera = SceneCamera(model, width // 2, 6, visibility=30.0, interpolation="bilinear")
    noise = contrast(camera) / 5.0
    random = np.random.default_rng(7)
    detector, tracker = BlobDetector(), Tracker(EXACT, TrackerSettings(least_separation=0.8))
    shown = found = 0
    errors, false = [], set()
    for k in range(pictures):
        north = k * period * speed
        places = [(6.0 * n, 3.0 * math.sin(n), 0.3 * n) for n in range(int(north / 6.0) - 2, int(north / 6.0) + 4)]
        angles = 0.05 * math.sin(0.6 * k * period), 0.03 * math.cos(0.5 * k * period), 0.2 * math.sin(0.1 * k * period)
        pose = ScenePose(north, 0.0, HEIGHT, 5.0, *angles, k * period)
        image = camera.take_picture(pose, [Glider(n, e, heading=h) for n, e, h in places])
        grain = random.standard_normal((*image.shape[:2], 3), np.float32) * np.float32(noise)
        image[..., :3] = np.clip(np.rint(image[..., :3] + grain), 0, 255)
        marks = detector.detect(image)
        standing = PoseOverPlane(north, 0.0, HEIGHT, angles)
        pixels = np.array([(mark.u, mark.v) for mark in marks]).reshape(-1, 2)
        located = zip(marks, project_to_plane(model, MOUNT, standing, pixels, EXACT), strict=True)
        seen = [at for mark, at in located if at and fits_size(at, mark.pixels, 0.8, 0.16)]
        for n, e, _ in places:
            to = np.linalg.inv(pose.pose.transform @ MOUNT) @ [n, e, pose.pose.z + HEIGHT, 1.0]
            (u, v), inside = model.project(to[:3])
            margin = 0.6 / HEIGHT * model.fx
            if inside and margin < u < model.width - margin and margin < v < model.height - margin:
                shown += 1
                found += any(math.dist((at.north + north, at.east), (n, e)) < 0.5 for at in seen)
        for track in tracker.update(k * period, standing, seen):
            off = min(math.dist(track.state, place[:2]) for place in places)
            if off < 0.5:
                errors.append(off)
            else:
                false.add(track.id)
    return found / shown, errors, len(false)


@pytest.mark.heavy
@pytest.mark.computing
def test_gliders_are_found_and_within_five_centimeters():
    share, errors, false = sail(50, 640)
    assert share >= 0.99
    assert len(errors) > 50
    assert math.sqrt(np.mean(np.square(errors))) <= 0.05
    assert false == 0


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize(("pictures", "width"), [(300, 640), repeat((3000, 640)), repeat((300, 1280))])
def test_minutes_without_a_false_track(pictures, width):
    share, errors, false = sail(pictures, width)
    assert share >= 0.99
    assert math.sqrt(np.mean(np.square(errors))) <= 0.05
    assert false <= 1
