"""A vehicle on a computer that lacks an extra of Shoal."""

import sys
from pathlib import Path

import pytest

from runtime.kernel import WallClock
from runtime.profile import load_profile
from runtime.vehicle import build
from tests.command import shoal

LIBRARIES = ("PIL", "serial", "pymavlink", "pyftpdlib", "starlette")
SHORT = ("--clock", "virtual", "--for", "1s")
PLAN = "plan: box\norigin: 41.185°, -8.7062°\nspeed: 1.2 m/s\nmaneuvers:\n  - goto: {north: 8, depth: 0}\n"


@pytest.fixture(autouse=True)
def core(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Without the extras, as after `pip install .`."""
    for library in LIBRARIES:
        monkeypatch.setitem(sys.modules, library, None)
    monkeypatch.chdir(tmp_path)


def test_the_core_install_runs_a_vehicle() -> None:
    done = shoal("run", "lauv-noptilus-1", "-p", "Simulation", *SHORT)
    assert done.exit_code == 0, done.output
    made = build(load_profile("lauv-noptilus-1"), {"Simulation"}, clock=WallClock())
    made.vehicle.close()
    assert made.skipped == {
        "needs pip install 'shoal[console]'": ["Transports.Console"],
        "needs pip install 'shoal[ftp]'": ["Transports.FTP"],
        "needs pip install 'shoal[mavlink]'": ["Transports.MAVLink"],
    }


@pytest.mark.parametrize("library", ["uvicorn", "websockets"])
def test_a_part_of_an_extra_that_others_have_installed_is_not_it(library: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for each in LIBRARIES:
        monkeypatch.delitem(sys.modules, each)
    monkeypatch.setitem(sys.modules, library, None)
    made = build(load_profile("lauv-noptilus-1"), {"Simulation"}, clock=WallClock())
    made.vehicle.close()
    assert made.skipped == {"needs pip install 'shoal[console]'": ["Transports.Console"]}


@pytest.mark.parametrize(
    ("profile", "modes", "place", "section", "extra"),
    [
        ("lauv-noptilus-1", "Simulation,Camera", "cameras.ini:8", "Vision.FisheyeCamera", "vision"),
        ("lauv-noptilus-1", "Hardware", "hardware.ini:3", "Sensors.GPS", "drivers"),
        ("autopilot-copter", "Hardware", "autopilot-copter.ini:17", "Control.Autopilot.MAVLink", "mavlink"),
    ],
)
def test_a_device_that_was_asked_for_is_not_left_out(
    profile: str, modes: str, place: str, section: str, extra: str, tmp_path: Path
) -> None:
    clock = SHORT if "Camera" in modes else ()
    done = shoal("run", profile, "-p", modes, *clock)
    expected = f"{place}: error: [{section}] needs pip install 'shoal[{extra}]' (`Enabled = Never` leaves it out)"
    assert (done.exit_code, expected in done.output) == (2, True), done.output
    assert not (tmp_path / "log").exists()
    done = shoal("check", profile, "-p", modes)
    assert (done.exit_code, expected in done.output) == (1, True), done.output
    done = shoal("check", profile)
    assert (done.exit_code, f"{place}: note: [{section}] needs" in done.output) == (0, True), done.output
    done = shoal("service", profile, "-p", modes)
    assert (done.exit_code, expected in done.output) == (2, True), done.output


def test_a_mission_does_not_leave_out_a_camera_but_the_user_can(tmp_path: Path) -> None:
    (tmp_path / "plan.yaml").write_text(PLAN)
    done = shoal("mission", "otter", "plan.yaml", "-p", "Simulation,Camera")
    assert (done.exit_code, "pip install 'shoal[vision]'" in done.output) == (2, True), done.output
    left_out = ("--set", "Vision.FisheyeCamera:Enabled=Never")
    done = shoal("run", "otter", "-p", "Simulation,Camera", *SHORT, *left_out)
    assert done.exit_code == 0, done.output


def test_a_task_in_another_process_needs_its_extra_only_there() -> None:
    profile = load_profile("otter", overrides=["Vision.FisheyeCamera:Process=Eyes"])
    made = build(profile, {"Simulation", "Camera"}, clock=WallClock(), process="")
    labels = [entity.label for entity in made.vehicle.entities]
    made.vehicle.close()
    assert "Fisheye Camera" in labels
