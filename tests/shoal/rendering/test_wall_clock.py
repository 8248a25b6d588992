"""Pictures of a run on a wall clock are rendered for the moments at which its cameras were exposed."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import imc
from runtime.kernel import WallClock
from runtime.profile import load_profile
from runtime.vehicle import build
from shoal.rendering import find_exposures
from tests.command import shoal
from world.rendering import optical_to_body_transform

pytestmark = pytest.mark.heavy
SETTINGS = ("Size=96", "Face Size=48", "Frame Rate=6", "Save Images=true")
SECONDS = 3.0


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The folder of the last log of a short real run of a LAUV with its camera, and when the vehicle started."""
    root = tmp_path_factory.mktemp("wall")
    camera = [f"Vision.FisheyeCamera:{setting}" for setting in SETTINGS]
    profile = load_profile("lauv-noptilus-1", overrides=[*camera, "World:Gliders=1 0.3, 3 -1"])
    made = build(profile, profile.parse_modes("Simulation,Camera"), clock=WallClock(), log_root=root)
    vehicle = made.vehicle
    vehicle.start()
    while len(list(root.glob("*/*/*_dive/Photos/*.png"))) < 5:
        vehicle.run(SECONDS)
    vehicle.close()
    return max(root.glob("*/*/*_dive")), vehicle.start_time


@pytest.fixture
def log(run):
    return run[0]


def taken(folder):
    """The pictures in a folder, by camera and time; their numbers begin anew in each log."""
    return {tuple(path.stem.rsplit("_", 2)[::2]): path for path in folder.glob("*.png")}


def test_each_picture_has_its_partner(log, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = shoal("log", "render", str(log), "out", "--no-labels", "-j", "1")
    assert (done.exit_code, "note" in done.output) == (0, False), done.output
    before, after = taken(log / "Photos"), taken(Path("out/Photos"))
    assert len(before) >= 5
    assert before.keys() <= after.keys()  # the end of the run may have been before one was written
    for name in before:
        one, other = (np.asarray(Image.open(found[name])) for found in (before, after))
        assert np.mean(np.any(one != other, axis=-1)) < 0.02  # the state before may be the one that the camera had


def test_the_camera_is_where_the_log_says(run):
    log, start = run
    seen = find_exposures(imc.Log(log))
    rows = {row["time"]: row for row in imc.Log(log).array("CameraFrame")}
    assert len(seen.pictures) == len(rows)
    for shot in seen.pictures:
        assert shot.time - shot.standpoints[0].time == pytest.approx(start, abs=1e-5)
        row, mount = rows[shot.time], optical_to_body_transform(seen.camera_of(shot).camera.mount)
        x, y, z = (shot.standpoints[0].pose.transform @ mount)[:3, 3]
        np.testing.assert_allclose((x, y, z), (row["x"], row["y"], row["z"]), atol=1e-3)


def test_a_data_set_lacks_no_picture(log, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = shoal("log", "export", str(log), "set", "-f", "coco")
    assert (done.exit_code, "skipped" in done.output) == (0, False), done.output
    found = json.loads(Path("set/annotations.json").read_text())
    assert len(found["images"]) == len(taken(log / "Photos")) >= 5
    assert found["annotations"]


def test_another_rate_is_that_of_the_file(log, tmp_path):
    ini = tmp_path / "cameras.ini"
    ini.write_text("[Vision.FisheyeCamera]\nEntity Label = Fisheye Camera\nSize = 40\nFrame Rate = 2\n")
    seen = find_exposures(imc.Log(log), ini)
    assert np.allclose(np.diff([shot.time for shot in seen.pictures]), 0.5)
    assert seen.notes == ["cut, or made on a wall clock: the log does not contain when Fisheye Camera was exposed"]
