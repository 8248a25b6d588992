"""A camera of a calibration file goes on from a snapshot with the pictures that the run would have taken."""

import os
import subprocess
import sys

import pytest

from support.pose import DOWN
from tasks.vision.cameras.camera_metadata import write_cameras
from world.optics import PinholeModel

PROFILE = """
[Require lauv-noptilus-1.ini]

[Vision.Camera/Front]
Enabled            = Simulation
Entity Label       = Front Camera
Calibration        = cameras.yaml
Calibration Camera = Front
Mount Position     = 0.5, 0.1, 0
Mount Orientation  = 0, -60, 0
Frame Rate         = 4
Face Size          = 32
Save Images        = true
"""


def shoal(folder, *words):
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-m", "shoal.cli", *words]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0, done.stderr


def pictures(root):
    """By the time in their names, since their numbers count anew in each log."""
    return {path.stem.rpartition("_")[2]: path.read_bytes() for path in root.glob("log/*/*/*/Photos/*.png")}


@pytest.mark.heavy
def test_pictures_go_on_as_those_of_the_uninterrupted_run(tmp_path):
    optics = PinholeModel(64, 48, 50.0, 51.0, 33.0, 23.0, -0.1, 0.01)
    (tmp_path / "rest").mkdir()
    others = {"Aft": (PinholeModel(64, 48, 90.0, 90.0, 32.0, 24.0), DOWN), "Front": (optics, DOWN)}
    assert write_cameras(tmp_path / "whole", others) == ""
    (tmp_path / "whole" / "mine.ini").write_text(PROFILE)
    words = ("-p", "Simulation", "--clock", "virtual", "--for", "6s", "--snapshot-every", "3s")
    shoal(tmp_path / "whole", "run", "mine.ini", *words)
    (state,) = (tmp_path / "whole").glob("log/*/*/*/State-3.msgpack")
    shoal(tmp_path / "rest", "run", "--from-snapshot", str(state), "--clock", "virtual", "--for", "3s")
    whole, rest = pictures(tmp_path / "whole"), pictures(tmp_path / "rest")
    later = {time for time in whole if time > min(rest)}
    assert len(later) > 8
    assert {time: rest[time] for time in later} == {time: whole[time] for time in later}
