"""A camera whose parameters change during a run: pictures after the fact have the lens of their time."""

import json
from pathlib import Path

import pytest
from PIL import Image

import imc
from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import build
from tests.command import shoal

LABEL = "Fisheye Camera"
CONSOLE = 0x4001


def run(root: Path, change):
    """The log of a run in which `change(vehicle)` happens after 6.2 s."""
    settings = [f"Vision.FisheyeCamera:{setting}" for setting in ("Size=48", "Face Size=24", "Frame Rate=2")]
    profile = load_profile("lauv-noptilus-1", overrides=[*settings, "Plan.Autostart:Enabled=Never"])
    modes = profile.parse_modes("Simulation,Camera")
    vehicle = build(profile, modes, clock=VirtualClock(profile.start_time_ns), log_root=root).vehicle
    vehicle.start()
    vehicle.kernel.after(6.2, change, vehicle)
    vehicle.run(8.0)
    folder = vehicle.log_folder
    vehicle.close()
    return folder


def ask(vehicle):
    """A console, whose clock is an hour ahead, asks for other parameters."""
    values = {"Size": "64", "Field of View": "120", "Frame Rate": "4"}
    params = tuple(imc.EntityParameter(name=name, value=value) for name, value in values.items())
    ahead = vehicle.kernel.now + 3600.0
    order = imc.SetEntityParameters(timestamp=ahead, src=CONSOLE, dst=vehicle.system, name=LABEL, params=params)
    vehicle.bus.deliver_and_send(order, imc.encode(order), None)


def alter(vehicle):
    """A task is changed by hand, of which no message tells."""
    camera = vehicle.task("Vision.FisheyeCamera")
    camera.size = 64
    camera.configure()


@pytest.fixture(scope="module")
def altered(tmp_path_factory):
    return run(tmp_path_factory.mktemp("altered"), alter)


def call(*words: object):
    done = shoal(*words)
    assert done.exit_code == 0, done.output
    return done.output


@pytest.fixture(scope="module")
def asked(tmp_path_factory):
    return run(tmp_path_factory.mktemp("asked"), ask)


@pytest.mark.heavy
def test_pictures_after_the_fact_are_those_of_the_run(asked, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = call("log", "render", asked, "out", "-j", "1", "--flow")
    assert "note" not in said
    taken = {path.name: path.read_bytes() for path in (asked / "Photos").iterdir()}
    assert {path.name: path.read_bytes() for path in Path("out/Photos").iterdir()} == taken
    sizes = [Image.open(path).size[0] for path in sorted(Path("out/Photos").glob("*.png"))]
    assert sizes == [48] * 12 + [64] * 7
    assert [each["width"] for each in json.loads(Path("out/labels.json").read_text())["pictures"]] == sizes
    call("log", "export", asked, "coco", "-f", "coco")
    assert [image["width"] for image in json.loads(Path("coco/annotations.json").read_text())["images"]] == sizes


def test_data_sets_have_no_pictures_of_another_lens_than_their_calibration(asked, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = "pictures of Fisheye_Camera were taken with another lens or size than in cameras.yaml"
    for form, pictures in (("euroc", "mav0/cam0/data"), ("tum", "rgb")):
        assert f"12 messages: {text}" in call("log", "export", asked, form, "-f", form)
        assert [Image.open(path).size[0] for path in Path(form, pictures).iterdir()] == [64] * 7
    assert f"no CameraInfo: {text}" in call("log", "export", asked, "a.mcap", "-f", "mcap")


def test_render_says_how_many_frames_another_lens_took(altered, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = call("log", "render", altered, "out", "--no-labels", "-j", "1")
    assert f"3 frames of {LABEL} were taken with another lens or size, which changed unnoticed" in said


def test_data_sets_have_no_labels_of_another_lens(altered, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert "was taken with another lens, which changed unnoticed" in call("log", "export", altered, "out", "-f", "coco")
    images = json.loads(Path("out/annotations.json").read_text())["images"]
    files = len(list((altered / "Photos").glob("*.png")))
    assert len(images) == files - 3 > 3
    assert {image["width"] for image in images} == {48}
