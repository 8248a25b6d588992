"""`shoal mission` and `shoal.fly` with a whole simulated vehicle."""

import json
import math
import re
import subprocess
from pathlib import Path

import pytest

import imc
from shoal import fly
from shoal.missions import Mission, load_plan, locate_reason, parse_plan, prepare
from tests.outside import NO_FILE, TOO_LARGE, largest_file
from tests.shoal.cli.installed import SHOAL, shoal

RECORDED = Path(__file__).parents[2] / "data" / "plans" / "three_gotos.json"
SHORT = """
plan: short
origin: 41.185°, -8.7062°
speed: 1.2 m/s
maneuvers:
  - goto: {north: 40, depth: 2}
  - idle: {duration: 2}
"""
DEEP = SHORT.replace("depth: 2", "depth: 200")


def mission(*arguments, cwd):
    return shoal("mission", *arguments, cwd=cwd)


@pytest.mark.heavy
def test_a_log_that_does_not_fit_on_the_disk_is_said_and_is_no_success(tmp_path):
    (tmp_path / "plan.yaml").write_text(SHORT)
    command = [*SHOAL, "mission", "lauv-noptilus-1", "plan.yaml", "--json"]
    with largest_file(20_000):
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert (done.returncode, json.loads(done.stdout)["outcome"]) == (1, "SUCCESS")
    lack = rf"the log is not complete: \d+\.\d MiB of messages are not on the disk: {TOO_LARGE}"
    assert re.search(lack, done.stderr)


@pytest.mark.heavy
def test_a_mission_is_reproducible_with_and_without_a_log(tmp_path):
    first, second = (fly(parse_plan(SHORT), seed=3, limit=300, log_root=root) for root in (None, tmp_path))
    assert first.completed
    assert first == second
    assert len(list(tmp_path.rglob("Data.lsf.gz"))) == 3


def test_without_a_folder_for_it_a_vehicle_has_no_log(tmp_path):
    made = prepare("lauv-noptilus-1", log_root=None, state_folder=tmp_path)
    assert not any(task.name == "Transports.Logging" for task in made.vehicle.tasks)
    made.vehicle.start()
    made.vehicle.run(3.0)
    made.vehicle.close()
    assert made.vehicle.log_folder is None
    assert not (tmp_path / "log").exists()


@pytest.mark.heavy
def test_files_that_cannot_be_read(tmp_path):
    status, _, error = mission("lauv-noptilus-1", tmp_path / "none.yaml", cwd=tmp_path)
    assert (status, error) == (2, f"Error: {tmp_path / 'none.yaml'}: {NO_FILE}\n")
    (tmp_path / "plan.yaml").write_text(SHORT)
    wrong = ("--set", "General:Absolute Maximum Depth=deep")
    status, _, error = mission("lauv-noptilus-1", "plan.yaml", *wrong, cwd=tmp_path)
    assert status == 2
    assert "Maneuver.YoYo: Absolute Maximum Depth: [General] has 'deep', which is not a number" in error


def test_a_plan_that_cannot_be_flown_says_why():
    deep = parse_plan(SHORT.replace("depth: 2", "depth: 200"))
    report = fly(deep, limit=300)
    assert report.outcome == "FAILURE"
    assert report.reason == "Goto1: maneuver depth beyond limits: 200 m, the vehicle goes down to 49 m"
    assert report.legs == []


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("name", "text", "line"),
    [
        ("plan.yaml", DEEP, 6),
        ("plan.json", json.dumps(parse_plan(DEEP).to_dict(), indent=1), 14),
    ],
)
def test_a_plan_that_cannot_be_flown_names_its_line(name, text, line, tmp_path):
    (tmp_path / name).write_text(text)
    status, out, _ = mission("lauv-noptilus-1", name, cwd=tmp_path)
    assert (status, f"{name}:{line}: Goto1: maneuver depth beyond limits: 200 m" in out) == (1, True), out


@pytest.mark.parametrize("text", ["]", "plan: a\nmaneuvers:\n  - idle:\n", '{"abbrev": "PlanSpecification"}', "[" * 99])
def test_a_reason_that_names_no_line_of_the_plan_stays_as_it_is(text, tmp_path):
    path = tmp_path / "plan.yaml"
    path.write_text(text)
    assert locate_reason(path, "Goto1: too deep") == "Goto1: too deep"
    assert locate_reason(tmp_path / "none.yaml", "Goto1: too deep") == "Goto1: too deep"


@pytest.mark.heavy
def test_a_vehicle_that_knows_no_plans_says_what_it_lacks():
    report = fly(parse_plan(SHORT), modes=["Kinematic"], limit=300)
    assert report.outcome == "FAILURE"
    assert report.reason == "vehicle not ready within 120 s: missing Supervisors.Vehicle and Plan.Engine"


@pytest.mark.heavy
def test_a_limit_ends_a_mission():
    report = fly(load_plan(RECORDED), limit=60)
    assert (report.outcome, report.reason) == ("TIMEOUT", "plan not finished")
    assert report.maneuvers == ["Goto1"]


@pytest.mark.heavy
def test_the_command_prints_what_came_of_it(tmp_path):
    (tmp_path / "plan.yaml").write_text(SHORT, encoding="utf-8")
    status, out, err = mission("lauv-noptilus-1", "plan.yaml", cwd=tmp_path)
    estimate = r"estimated time 3\d s, energy 0\.\d % of the battery, which has 100\.0 %\n"
    assert (status, bool(re.fullmatch(estimate, err))) == (0, True), err
    lines = out.splitlines()
    assert lines[0] == "short: SUCCESS, plan completed"
    words = ["maneuver", "Goto1", "IdleManeuver2", "all", "energy:", "log:"]
    assert [line.split()[0] for line in lines[1:]] == words
    (data,) = (tmp_path / "log" / "lauv-noptilus-1").glob("*/*_short/Data.lsf.gz")
    assert str(data.parent.relative_to(tmp_path)) in lines[-1]


@pytest.mark.parametrize("texts", ["", "Total=", "Total=soon", "Execution=3.0", "Total=nan"])
def test_an_estimate_that_is_no_number_is_unknown(texts, tmp_path):
    vehicle = prepare("lauv-noptilus-1", log_root=None, state_folder=tmp_path).vehicle
    flight = Mission(vehicle, parse_plan(SHORT))
    statistics = imc.PlanStatistics(type=imc.PlanStatistics.Type.PREPLAN, durations=texts, fuel=texts)
    vehicle.kernel.soon(vehicle.daemon.publish, statistics)
    vehicle.start()
    vehicle.run(0.1)
    vehicle.close()
    assert math.isnan(flight.report.estimated_seconds)
    assert math.isnan(flight.report.estimated_energy)


@pytest.mark.heavy
def test_a_failed_plan_has_its_cause_its_energy_and_its_log(tmp_path):
    (tmp_path / "plan.yaml").write_text(SHORT, encoding="utf-8")
    current = ("--set", "Simulators.StreamVelocity:Default Speed East=1.9")
    status, out, _ = mission("lauv-noptilus-1", "plan.yaml", *current, "--json", cwd=tmp_path)
    report = json.loads(out)
    assert (status, report["reason"]) == (1, "vehicle errors: Path Control: along-track divergence error")
    assert (tmp_path / report["log"] / "Data.lsf.gz").is_file()
    assert report["estimated_seconds"] == pytest.approx(30.0, abs=3.0)
    assert 0.0 < report["battery_before"] - report["battery_after"] < 3 * report["estimated_energy"]


@pytest.mark.heavy
def test_the_command_has_an_exit_status_for_ci(tmp_path):
    (tmp_path / "plan.yaml").write_text(SHORT.replace("depth: 2", "depth: 200"), encoding="utf-8")
    status, out, _ = mission("lauv-noptilus-1", "plan.yaml", "--json", cwd=tmp_path)
    summary = json.loads(out)
    assert (status, summary["outcome"], summary["legs"]) == (1, "FAILURE", [])
    assert summary["cross_track"] is None
    (tmp_path / "plan.yaml").write_text("plan: x\nmaneuvers:\n  - fly: {}\n", encoding="utf-8")
    for arguments in (
        ["lauv-noptilus-1", "plan.yaml"],
        ["no-such-vehicle", "plan.yaml"],
        ["lauv-noptilus-1", "no.yaml"],
    ):
        status, out, err = mission(*arguments, cwd=tmp_path)
        assert (status, out) == (2, "")
        assert err.startswith("Error: ")
        assert "Traceback" not in err


@pytest.mark.heavy
def test_changes_that_change_nothing_are_said(tmp_path):
    (tmp_path / "plan.yaml").write_text(SHORT.replace("depth: 2", "depth: 200"), encoding="utf-8")
    for change, status, words in (
        ("Simulators.StreamVelocity:Default Speed Nort=1", 1, "'Default Speed Nort' is not a parameter"),
        (
            "Simulators.IMU:Enabled=Never",
            2,
            "no section [Simulators.IMU] (did you mean 'Simulators.IMU/AHRS'?)",
        ),
    ):
        done, _, err = mission("lauv-noptilus-1", "plan.yaml", "--set", change, cwd=tmp_path)
        assert (done, words in err) == (status, True), err


@pytest.mark.parametrize("period", ["0", "0.001s", "-1s"])
def test_a_state_is_saved_now_and_then_only(period, tmp_path):
    (tmp_path / "plan.yaml").write_text(SHORT, encoding="utf-8")
    status, _, err = mission("lauv-noptilus-1", "plan.yaml", f"--snapshot-every={period}", cwd=tmp_path)
    assert (status, "--snapshot-every" in err, "Traceback" in err) == (2, True, False)
