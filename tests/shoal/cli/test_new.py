"""`shoal new`: tasks, drivers and vehicles that run, and pass the tests that come with them."""

import subprocess
import sys

import pytest

from tests.repeats import repeat


@pytest.mark.heavy
def test_a_new_task_runs_and_its_test_passes(shoal, tmp_path):
    result = shoal("new", "task", "DepthAlarm")
    assert result.exit_code == 0, result.output
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "test_depth_alarm.py"], cwd=tmp_path, capture_output=True, text=True
    )
    assert "1 passed" in done.stdout, done.stdout + done.stderr
    assert shoal("new", "task", "DepthAlarm").exit_code == 2
    assert "How often to report." in shoal("tasks", "depth_alarm.DepthAlarm").output


@pytest.mark.heavy
def test_a_new_driver_passes_its_test(shoal, tmp_path):
    result = shoal("new", "driver", "DepthCell")
    assert result.exit_code == 0, result.output
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "test_depth_cell.py"], cwd=tmp_path, capture_output=True, text=True
    )
    assert "2 passed" in done.stdout, done.stdout + done.stderr
    assert "Baud rate of the port." in shoal("tasks", "depth_cell.DepthCell").output


@pytest.mark.heavy
def test_a_new_vehicle_runs_and_its_test_passes(shoal, tmp_path):
    assert shoal("new", "vehicle", "lauv-mine").exit_code == 0
    result = shoal("check", "lauv-mine")
    assert result.exit_code == 0
    assert "warning" not in result.output
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "test_lauv_mine.py"], cwd=tmp_path, capture_output=True, text=True
    )
    assert "1 passed" in done.stdout, done.stdout + done.stderr


@pytest.mark.heavy
@pytest.mark.parametrize("base", [repeat("lauv-noptilus-1"), "otter", repeat("caravel"), "hexa-00"])
def test_a_vehicle_from_another_carries_out_plans(shoal, tmp_path, base):
    created = shoal("new", "vehicle", "mine", "--from", base)
    assert created.exit_code == 0, created.output
    (tmp_path / "plan.yaml").write_text("plan: p\nmaneuvers: [{idle: {duration: 2}}]\n")
    flown = shoal("mission", "mine", "plan.yaml")
    assert flown.exit_code == 0, flown.output
    assert list((tmp_path / "log" / "mine").glob("*/*_p/Data.lsf.gz"))


def test_a_vehicle_from_an_unknown_profile_is_not_created(shoal, tmp_path):
    result = shoal("new", "vehicle", "mine", "--from", "lauv-noptilus-9")
    assert (result.exit_code, "did you mean" in result.output) == (2, True), result.output
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["../evil", "a/b", "class", "", "1up", "imc"])
def test_names_of_tasks_that_cannot_be_are_refused(shoal, tmp_path, name):
    assert shoal("new", "task", name).exit_code != 0
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["../evil", "a/b", "", ".hidden", "a b", "x" * 100])
def test_names_of_vehicles_that_cannot_be_are_refused(shoal, tmp_path, name):
    assert shoal("new", "vehicle", name).exit_code != 0
    assert list(tmp_path.iterdir()) == []
