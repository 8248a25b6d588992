"""A camera whose parameters change during a run: its log says which frames another lens took."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

import imc
from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import build
from shoal.cli import main

LABEL = "Fisheye Camera"


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    root = tmp_path_factory.mktemp("changed")
    settings = [f"Vision.FisheyeCamera:{setting}" for setting in ("Size=48", "Face Size=24", "Frame Rate=2")]
    profile = load_profile("lauv-noptilus-1", overrides=[*settings, "Plan.Autostart:Enabled=Never"])
    modes = profile.select("Simulation,Camera")
    vehicle = build(profile, modes, clock=VirtualClock(profile.start_time_ns), log_root=root).vehicle
    size = imc.SetEntityParameters(name=LABEL, params=(imc.EntityParameter(name="Size", value="64"),))
    vehicle.start()
    vehicle.kernel.after(6.2, vehicle.task("Simulators.GPS").publish, size)
    vehicle.run(8.0)
    folder = vehicle.log_folder
    vehicle.close()
    return folder


def test_render_says_how_many_frames_another_lens_took(log, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(main, ["log", "render", str(log), "out", "--no-labels", "-j", "1"])
    assert done.exit_code == 0, done.output
    assert f"3 frames of {LABEL} were taken with another lens or size, which changed during the run" in done.output


def test_data_sets_have_no_labels_of_another_lens(log, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(main, ["log", "export", str(log), "out", "-f", "coco"])
    assert done.exit_code == 0, done.output
    assert "was taken with another lens, which changed during the run" in done.output
    images = json.loads(Path("out/annotations.json").read_text())["images"]
    files = len(list((log / "Photos").glob("*.png")))
    assert len(images) == files - 3 > 3
    assert {image["width"] for image in images} == {48}
