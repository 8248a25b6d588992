"""What OpenCV tracks from picture to picture moves as the optical flow of the labels says, through any lens."""

import math

import cv2
import numpy as np
import pytest

from world.optics import LENS_PRESETS, DoubleSphereModel, FisheyeModel, PinholeModel, preset_lens
from world.rendering import SceneCamera, ScenePose

WIDE = {
    name: FisheyeModel.from_lens(preset_lens(name, min(lens.max_field_of_view, math.pi)), 512)
    for name, lens in LENS_PRESETS.items()
}
LENSES = {
    **WIDE,
    "pinhole": PinholeModel(640, 480, 381.4, 381.4, 320.0, 240.0),
    "brown": PinholeModel(640, 480, 480.0, 470.0, 331.0, 236.0, -0.28, 0.07, 3e-4, -2e-4),
    "double sphere": DoubleSphereModel(512, 480, 160.0, 158.0, 250.0, 244.0, -0.2, 0.58),
}
BEFORE = ScenePose(3.0, -2.0, 4.0, 6.0, 0.02, -0.03, 0.4, time=1.0)
AFTER = ScenePose(3.06, -1.96, 4.02, 5.98, 0.03, -0.02, 0.41, time=1.0)


@pytest.mark.parametrize("optics", LENSES.values(), ids=list(LENSES))
def test_tracks_move_as_the_flow_says(optics):
    camera = SceneCamera(optics, 0, 5, "bilinear", "Seabed", 60.0, seed=3)
    first, second = (cv2.cvtColor(camera.take_picture(at), cv2.COLOR_RGBA2GRAY) for at in (BEFORE, AFTER))
    flow = camera.labels(BEFORE, following=(AFTER, ())).flow
    corners = cv2.goodFeaturesToTrack(first, 600, 0.02, 6)
    moved, found, _ = cv2.calcOpticalFlowPyrLK(first, second, corners, None, winSize=(21, 21), maxLevel=3)
    back, returned, _ = cv2.calcOpticalFlowPyrLK(second, first, moved, None, winSize=(21, 21), maxLevel=3)
    kept = (found & returned).ravel().astype(bool) & (np.abs(back - corners).max(axis=(1, 2)) < 0.3)
    assert np.count_nonzero(kept) > 150
    at, tracked = corners[kept, 0], (moved - corners)[kept, 0]
    wanted = cv2.remap(flow, at[:, :1], at[:, 1:], cv2.INTER_LINEAR)[:, 0]
    covered = np.isfinite(wanted).all(axis=1)
    apart = np.linalg.norm(tracked - wanted, axis=1)[covered]
    assert np.count_nonzero(covered) > 150
    assert np.median(apart) <= 0.15
