"""Pictures of a camera on the disk: what cameras.yaml tells, slow and full disks, names."""

import time

import numpy as np
import pytest
import yaml

import imc
from runtime import Frame, periodic
from runtime.kernel import VirtualClock, WallClock
from runtime.profile import load_profile
from runtime.testing import simulate
from runtime.vehicle import build
from tasks.vision.camera import Camera
from tasks.vision.cameras.external_camera import ExternalCameraTask
from tasks.vision.cameras.picture_files import write_picture

NORMAL, FAULT, FAILURE = (imc.EntityState.State[name] for name in ("NORMAL", "FAULT", "FAILURE"))
START = 1_767_225_600_000_000_000  # ns
SMALL = {"width": 64, "height": 48, "frame_rate": 5.0}


def states(seconds, rate=10):
    return [imc.EstimatedState(timestamp=n / rate, depth=5.0, z=5.0, alt=4.0) for n in range(int(seconds * rate))]


@pytest.mark.heavy
def test_what_is_reported_of_a_camera_is_what_it_was_at_the_exposure(tmp_path):
    """A shipped vehicle whose camera gets another lens and place while a picture is on its way."""
    profile = load_profile("lauv-noptilus-1", overrides=["Vision.Camera/Left:Frame Rate=5"])
    selected = profile.parse_modes(["Simulation", "Stereo"])
    vehicle = build(profile, selected, clock=VirtualClock(START), log_root=tmp_path).vehicle
    left = vehicle.task("Vision.Camera/Left")
    frames, told = [], []
    vehicle.observe(Frame, lambda frame: frames.append(frame) if frame.camera == "Left Camera" else None)
    vehicle.observe(imc.CameraFrame, lambda said: told.append(said) if said.src_ent == left.entity.id else None)
    vehicle.start()
    vehicle.run(2.01)
    folder = vehicle.log_folder / "Photos"
    before = yaml.safe_load((folder / "cameras.yaml").read_text())["Left Camera"]
    wanted = [imc.EntityParameter(name=n, value=v) for n, v in (("Width", "96"), ("Mount Position", "1, 0, 0"))]
    vehicle.task("Simulators.GPS").publish(imc.SetEntityParameters(name="Left Camera", params=tuple(wanted)))
    vehicle.run(1.0)
    vehicle.close()
    assert {frame.image.shape[1] for frame in frames} == {640, 96}
    for frame, said in zip(frames, told, strict=True):
        width = frame.image.shape[1]
        assert (frame.optics.width, said.width) == (width, width)
        assert frame.mount[0, 3] == (1.0 if width == 96 else 0.5)
        assert said.fx == pytest.approx(frame.optics.fx)
    after = yaml.safe_load((folder / "cameras.yaml").read_text())["Left Camera"]
    assert (before["T_BS"][0][3], after["T_BS"][0][3]) == (0.5, 1.0)
    assert (before["resolution"], after["resolution"]) == ([640, 480], [96, 480])


class Fast(ExternalCameraTask):
    """A camera that never waits for the disk."""

    @periodic(50.0)
    def shoot(self) -> None:
        self.deliver(self.now, np.zeros((4, 4, 4), np.uint8), self.now)


@pytest.mark.heavy
def test_a_slow_disk_loses_pictures_and_not_the_memory(tmp_path, monkeypatch):
    """Each picture takes 0.2 s to write, and one comes each 20 ms."""

    def slow(*given):
        time.sleep(0.2)
        return write_picture(*given)

    monkeypatch.setattr("tasks.vision.cameras.image_saver.write_picture", slow)
    run = simulate(Fast, seconds=1.5, clock=WallClock(), save_images=True, log_root=tmp_path)
    task = run.task
    assert task.lost > 0
    assert task.entity.state == FAILURE
    assert any("slower than the pictures" in text for text in run.log)
    named = [told.file for told in run.of(imc.CameraFrame)]
    assert named.count("") == task.lost
    assert 0 < len(list(tmp_path.rglob("*.png"))) <= len(named) - task.lost


def test_a_failure_ends_when_no_pictures_are_wanted_any_more(tmp_path):
    for number in range(2):  # where the pictures would be
        (tmp_path / f"ship/Photos/Camera_00000{number}_{1767225600.2 + number / 5:.6f}.png/x").mkdir(parents=True)
    order = imc.Event(timestamp=0.1, topic="Take Pictures", data="count=2")
    feed = sorted([*states(3.0), order], key=lambda message: message.timestamp)
    run = simulate(Camera, feed=feed, seconds=3.0, log_root=tmp_path, system="ship", **SMALL)
    assert [said.state for said in run.of(imc.EntityState)].count(FAILURE) == 1
    assert run.task.entity.state == NORMAL
    assert run.task.entity.description.endswith("2 pictures lost")


def test_without_cameras_yaml_pictures_are_written_and_the_entity_says_so(tmp_path):
    (tmp_path / "ship/Photos/cameras.yaml/x").mkdir(parents=True)
    run = simulate(Camera, feed=states(2.0), seconds=2.0, log_root=tmp_path, system="ship", save_images=True, **SMALL)
    assert len(list(tmp_path.rglob("*.png"))) == len(run.frames) > 5
    assert len([text for text in run.log if "cannot write" in text]) == 1
    assert run.task.entity.state == FAILURE
    assert "cameras.yaml" in run.task.entity.description
    assert "lost" not in run.task.entity.description


def test_two_cameras_whose_pictures_would_have_one_name_are_refused(tmp_path):
    settings = [f"Vision.Camera/{side}:Entity Label={label}" for side, label in (("Left", "Cam 1"), ("Right", "Cam-1"))]
    profile = load_profile("lauv-noptilus-1", overrides=settings)
    selected = profile.parse_modes(["Simulation", "Stereo"])
    with pytest.raises(Exception, match="pictures of 'Cam-1' and 'Cam 1' would have the same names"):
        build(profile, selected, clock=VirtualClock(START), log_root=tmp_path)


def test_an_estimate_that_falls_silent_is_a_fault():
    run = simulate(Camera, feed=states(1.0), seconds=4.0, **SMALL)
    assert run.task.entity.state == FAULT
    assert run.task.entity.description == "no recent EstimatedState"
    assert len(run.frames) == pytest.approx(9, abs=1)


def test_an_estimate_without_velocities_stays_where_it_is():
    feed = [said.replace(vx=np.nan, p=np.nan) for said in states(1.0)]
    run = simulate(Camera, feed=feed, seconds=1.0, **SMALL)
    assert all(np.isfinite(frame.pose).all() for frame in run.frames)
    assert run.task.entity.description.endswith("from EstimatedState")
