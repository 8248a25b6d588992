"""A computer that stands still: no camera is blamed for states that nobody could publish."""

import math
from itertools import product

import numpy as np
import pytest
from lean import UNLOGGED

import imc
from runtime import Frame, State, periodic
from runtime.kernel import SECOND
from runtime.profile import load_profile
from runtime.vehicle import build
from tasks.pose_history import PoseHistory
from tasks.vision.cameras.external_camera import ExternalCameraTask
from tasks.vision.fisheye_camera import FisheyeCamera
from tasks.vision.mug_detector import MUGDetector
from tests.outside import ALONE
from tests.repeats import all_but
from tests.tasks.mission.stalling_clock import StallingClock
from tests.tasks.vision.test_true_view import CONTEXT

START = 1_750_000_000 * SECOND
STALLS = [(20.03, 4.0), (35.21, 2.5)]
SETTLED = 15.0  # s


class Outside(ExternalCameraTask):
    """A camera whose pictures come from elsewhere, also right after a stall."""

    @periodic(7.0)
    def shoot(self) -> None:
        self.deliver(self.now, np.zeros((4, 4, 4), np.uint8), self.now)


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize(
    ("profile", "with_truth"),
    all_but([("otter", True), ("hexa-00", False)], product(["otter", "hexa-00"], [True, False])),
)
def test_after_a_stall_cameras_and_detectors_wait_for_states_and_blame_nobody(profile, with_truth, tmp_path):
    loaded = load_profile(profile, overrides=[*ALONE, UNLOGGED])
    clock = StallingClock(START, STALLS)
    vehicle = build(loaded, loaded.parse_modes("Simulation"), clock=clock, log_root=tmp_path).vehicle
    options = {"size": 32, "face_size": 16, "frame_rate": 7.0, "scene": CONTEXT[profile]}
    camera = vehicle.add(FisheyeCamera, "Vision.FisheyeCamera/Trial", entity_label="Trial", **options)
    options = {"camera": "Trial", "target_plane": "Surface"}
    detector = vehicle.add(MUGDetector, "Vision.MUGDetector/Trial", entity_label="Detector", **options)
    outside = vehicle.add(Outside, "Vision.Device/Outside", entity_label="Outside")
    frames, blamed, described, states = [], [], [], []

    def judge(state):
        label = vehicle.entities.label(state.src, state.src_ent)
        if label in ("Trial", "Detector", "Outside") and state.timestamp > vehicle.start_time + SETTLED:
            late = state.timestamp - vehicle.start_time
            blamed.extend([(late, label, state.description)] if state.state >= State.FAULT else [])

    vehicle.observe(imc.EntityState, judge)
    vehicle.observe(Frame, lambda frame: frames.append(frame) if frame.camera == "Trial" else None)
    vehicle.observe(imc.EstimatedState, states.append)
    vehicle.observe(imc.CameraFrame, lambda frame: described.append(frame) if _settled(frame, vehicle) else None)
    vehicle.worker.submit = lambda _, work: work()  # however slow this computer is
    vehicle.start()
    vehicle.run(1.0)
    if not with_truth:
        camera.viewpoint.update_truth = lambda _: None
    vehicle.run(50.0)
    vehicle.close()
    assert not clock.stalls
    assert not blamed
    seen = np.array([frame.time - START / SECOND for frame in frames])
    for at, length in STALLS:
        assert np.any((seen > at + length - 0.01) & (seen < at + length + 0.5)), "no picture soon after the stall"
    assert len(described) > 300
    assert not [frame.time for frame in described if math.isnan(frame.est_x)]
    assert not detector.dropped
    for at, length in STALLS:
        back = START / SECOND + at + length - 0.01
        frame = next(one for one in described if one.src_ent == outside.entity.id and one.time > back)
        after = next(state for state in states if state.timestamp >= frame.time)
        assert after.timestamp - frame.time < 0.2
        assert math.hypot(frame.est_x - after.x, frame.est_y - after.y) < 1.0


def _settled(frame, vehicle):
    return frame.time > vehicle.start_time + SETTLED


def states_at(*times):
    """A vehicle that swims north at 2 m/s until 10 s, and then east."""
    return [
        imc.EstimatedState(timestamp=t, x=2.0 * min(t, 10.0), y=2.0 * max(t - 10.0, 0.0), vx=vx, vy=2.0 - vx)
        for t, vx in ((t, 2.0 if t < 10.0 else 0.0) for t in times)
    ]


@pytest.mark.parametrize(
    ("time", "north", "east"),
    [(8.2, 16.4, 0.0), (8.9, 17.8, 0.0), (17.9, 20.0, 15.8), (17.0, 20.0, 14.0), (12.0, None, None)],
)
def test_in_a_long_gap_a_pose_is_that_of_the_nearer_state(time, north, east):
    """From 8 s to 18 s there was no state; a line between the two would be up to 14 m off."""
    history = PoseHistory(None)
    for state in states_at(7.9, 8.0, 18.0):
        history.add(state)
    pose = history.pose_at(time, 1.0)
    assert (pose is None) == (north is None)
    assert pose is None or (pose.x + 15.8, pose.y) == pytest.approx((north, east))
