"""What `shoal check` doubts of cameras: options that have no effect."""

import json

import pytest

from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import build, doubts
from tests.tasks.vision.test_camera import WOODSCAPE


@pytest.fixture
def doubted(tmp_path):
    """Texts of a shipped vehicle's doubts about its left camera, with these options."""

    def found(vehicle, *options):
        (tmp_path / "lens.json").write_text(json.dumps(WOODSCAPE))
        profile = load_profile(vehicle, overrides=[f"Vision.Camera/Left:{option}" for option in options])
        clock = VirtualClock(profile.start_time_ns)
        made = build(profile, profile.select("Simulation, Stereo"), clock=clock, log_root=tmp_path).vehicle
        texts = [problem.text for problem in doubts(made, profile) if "Vision.Camera/Left" in problem.text]
        made.close()
        return texts

    return found


def test_options_that_a_calibration_replaces_are_doubted(doubted, tmp_path):
    calibration = f"Calibration={tmp_path / 'lens.json'}"
    assert doubted("lauv-noptilus-1", calibration) == []
    assert doubted("lauv-noptilus-1", "Width=320", "Distortion=0.1") == []
    set_beside = "Width=320", "Height=200", "Field of View=60", "Distortion=0.1", "Principal Point=3, 4"
    assert sorted(doubted("lauv-noptilus-1", calibration, *set_beside)) == [
        f"[Vision.Camera/Left] {option.partition('=')[0]} has no effect: the Calibration replaces it"
        for option in sorted(set_beside)
    ]
