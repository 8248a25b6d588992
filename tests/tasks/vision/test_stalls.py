"""A computer that stands still: no camera is blamed for states that nobody could publish."""

import numpy as np
import pytest
from lean import UNLOGGED

import imc
from runtime import Frame, State
from runtime.kernel import SECOND
from runtime.profile import load_profile
from runtime.vehicle import build
from tasks.vision.fisheye_camera import FisheyeCamera
from tasks.vision.mug_detector import MUGDetector
from tests.outside import ALONE
from tests.tasks.mission.stalling_clock import StallingClock
from tests.tasks.vision.test_true_view import CONTEXT

START = 1_750_000_000 * SECOND
STALLS = [(20.03, 4.0), (35.21, 2.5)]
SETTLED = 15.0  # s


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize("with_truth", [True, False], ids=["truth", "estimates"])
@pytest.mark.parametrize("profile", ["otter", "hexa-00"])
def test_after_a_stall_cameras_and_detectors_wait_for_states_and_blame_nobody(profile, with_truth, tmp_path):
    loaded = load_profile(profile, overrides=[*ALONE, UNLOGGED])
    clock = StallingClock(START, STALLS)
    vehicle = build(loaded, loaded.parse_modes("Simulation"), clock=clock, log_root=tmp_path).vehicle
    options = {"size": 32, "face_size": 16, "frame_rate": 7.0, "scene": CONTEXT[profile]}
    camera = vehicle.add(FisheyeCamera, "Vision.FisheyeCamera/Trial", entity_label="Trial", **options)
    options = {"camera": "Trial", "target_plane": "Surface"}
    vehicle.add(MUGDetector, "Vision.MUGDetector/Trial", entity_label="Detector", **options)
    frames, blamed = [], []

    def judge(state):
        label = vehicle.entities.label(state.src, state.src_ent)
        if label in ("Trial", "Detector") and state.timestamp > vehicle.start_time + SETTLED:
            late = state.timestamp - vehicle.start_time
            blamed.extend([(late, label, state.description)] if state.state >= State.FAULT else [])

    vehicle.observe(imc.EntityState, judge)
    vehicle.observe(Frame, frames.append)
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
