"""What `shoal check` doubts of cameras: options that have no effect."""

import json

import pytest

from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.testing import simulate
from runtime.vehicle import build, config_warnings
from tasks.vision.camera import Camera
from tests.tasks.vision.test_camera import WOODSCAPE, states


@pytest.fixture
def doubted(tmp_path):
    """Texts of a shipped vehicle's doubts about its left camera, with these options."""

    def found(vehicle, *options):
        (tmp_path / "lens.json").write_text(json.dumps(WOODSCAPE))
        profile = load_profile(vehicle, overrides=[f"Vision.Camera/Left:{option}" for option in options])
        clock = VirtualClock(profile.start_time_ns)
        made = build(profile, profile.parse_modes("Simulation, Stereo"), clock=clock, log_root=tmp_path).vehicle
        texts = [problem.text for problem in config_warnings(made, profile) if "Vision.Camera/Left" in problem.text]
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


def test_a_housing_changes_nothing_in_air(doubted):
    assert doubted("lauv-noptilus-1", "Housing=Flat Port") == []
    assert doubted("hexa-00", "Housing=Flat Port") == [
        "[Vision.Camera/Left] Housing has no effect: Scene = Sea Surface is in air"
    ]
    bare, housed = (
        simulate(Camera, feed=states(z=-5.0, depth=0.0), scene="Sea Surface", housing=housing).frames[0]
        for housing in ("None", "Flat Port")
    )
    assert bare.optics == housed.optics
    assert (bare.image == housed.image).all()
