"""Runs of scenarios with shipped profiles: judgements, determinism, errors, and nothing left behind."""

import gzip
import hashlib
import math
import os
import re
import subprocess
import sys

import pytest

import imc
from runtime import Task, periodic
from shoal.scenarios import ScenarioFileError, load_document, run
from tests.shoal.scenarios.conftest import DIVE

JUDGED = """
seed: 3
expect:
  - {name: shallow, always: SimulatedState.z < 10 m}
  - {name: no error, never: VehicleState.op_mode == ERROR}
  - {name: too shallow, always: SimulatedState.z < 2 m}
  - {name: dives, eventually: EstimatedState.depth > 1 m, within: 60 s}
  - {name: flies, outcome: SUCCESS}
  - {name: known, finally: "distance(SimulatedState, EstimatedState) < 10 m"}
  - {name: cold, always: Turbidity.value < 3}
metrics:
  deepest: {max: SimulatedState.z}
  drift: {percentile: distance(SimulatedState, EstimatedState), of: 95}
  nothing: {mean: Turbidity.value}
"""


def by_name(result):
    return {verdict.name: verdict for verdict in result.verdicts}


@pytest.mark.heavy
def test_a_dive_is_judged_and_measured(play):
    result = play(JUDGED, DIVE)
    verdicts = by_name(result)
    assert result.error == ""
    assert result.outcomes == {"lauv-noptilus-1": "SUCCESS"}
    assert [name for name, verdict in verdicts.items() if not verdict.passed] == ["too shallow"]
    assert not result.passed
    assert verdicts["shallow"].margin == pytest.approx(10.0 - result.metrics["deepest"])
    assert verdicts["too shallow"].margin == pytest.approx(2.0 - result.metrics["deepest"])
    assert verdicts["too shallow"].margin == result.margin
    assert "failed first at" in verdicts["too shallow"].reason
    assert verdicts["too shallow"].origin.endswith("trial.scenario.yaml:16")
    assert verdicts["no error"].margin == math.inf
    assert 0.0 < result.metrics["drift"] < 10.0
    assert math.isnan(result.metrics["nothing"])
    assert not verdicts["cold"].applied
    assert any("cold proved nothing: no Turbidity of lauv-noptilus-1 arrived" in words for words in result.warnings)
    assert any("metric nothing: no Turbidity" in words for words in result.warnings)


@pytest.mark.heavy
def test_a_run_is_the_same_with_a_log_and_without_it(document, tmp_path):
    scenario = document("limit: 8 s\nmetrics: {east: {last: SimulatedState.u}}", DIVE).scenario()
    without, first, second = (run(scenario, seed=5, log_root=root) for root in (None, tmp_path / "a", tmp_path / "b"))
    assert without.fingerprint == first.fingerprint == second.fingerprint
    assert without.metrics == first.metrics
    assert without.logs == without.hashes == {}
    assert first.hashes == second.hashes
    log = imc.Log(first.logs["lauv-noptilus-1"])
    assert len(list(log.messages(imc.SimulatedState))) > 0
    assert run(scenario, seed=6).fingerprint != first.fingerprint


@pytest.mark.heavy
def test_a_run_does_not_depend_on_the_hash_seed(document):
    path = document("expect: [{always: SimulatedState.z < 9 m}]").path
    code = (
        "import sys; from pathlib import Path; from shoal.scenarios import *; "
        "print(run(load_document(Path(sys.argv[1])).scenario()).fingerprint)"
    )
    found = subprocess.run(
        [sys.executable, "-c", code, str(path)],
        env={**os.environ, "PYTHONHASHSEED": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert found.stdout == run(load_document(path).scenario()).fingerprint + "\n"


@pytest.mark.parametrize("profile", ["lauv-noptilus-1", "otter", "hexa-00", "caravel"])
def test_nothing_is_left_behind(play, profile, tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    monkeypatch.chdir(tmp_path)
    begin = f"vehicle: {{profile: {profile}}}\nlimit: 2 s\n"
    play("", begin)
    before = os.listdir("/proc/self/fd")
    result = play("", begin)
    assert result.passed
    assert result.seconds == 2.0
    assert len(os.listdir("/proc/self/fd")) == len(before)
    assert [path.name for path in tmp_path.iterdir()] == ["trial.scenario.yaml"]


def test_a_plan_that_is_refused_is_a_verdict(play):
    begin = DIVE.replace("depth: 3 m", "depth: 3000 m")
    asked = play("expect: [{outcome: SUCCESS}]", begin)
    assert asked.error == ""
    assert not asked.passed
    assert asked.verdicts[0].reason.startswith("FAILURE, ")
    assert play("expect: [{outcome: FAILURE}]", begin).passed
    unasked = play("", begin)
    assert [verdict.name for verdict in unasked.verdicts] == ["the plan of lauv-noptilus-1 begins"]
    assert re.search(r"trial.scenario.yaml:\d+$", unasked.verdicts[0].origin)
    assert not unasked.passed


def test_a_plan_that_fails_on_the_way_is_a_warning_unless_its_outcome_is_expected(play):
    events = "events: [{when: VehicleState.op_mode == MANEUVER, after: 1 s, plan: stop}]\n"
    result = play(events, DIVE)
    assert result.outcomes == {"lauv-noptilus-1": "FAILURE"}
    assert result.warnings == ("the plan of lauv-noptilus-1 has failed, and no outcome is expected: plan was stopped",)
    assert play(events + "expect: [{outcome: FAILURE}]", DIVE).warnings == ()


def test_a_plan_that_takes_too_long_is_late(play):
    result = play("limit: 5 s\nexpect: [{outcome: TIMEOUT}]", DIVE)
    assert result.passed
    assert result.seconds == 5.0


class Faulty(Task):
    """Fails after a while."""

    @periodic(1.0)
    def fail(self):
        if self.now_ns % 10_000_000_000 == 2_000_000_000:
            raise RuntimeError("out of order")


class Unable(Task):
    """Cannot be made."""

    def __init__(self, *given, **more):
        raise ZeroDivisionError("of a kind")


def test_a_vehicle_that_cannot_be_built_is_reported_before_the_run(document, tmp_path):
    profile = tmp_path / "own.ini"
    profile.write_text(f"[Require otter.ini]\n[{__name__}.Unable]\nEnabled = Simulation\n[General]\nVehicle = own\n")
    made = document("expect: [{always: SimulatedState.z < 9 m}]", "vehicle: {profile: own.ini}\n")
    with pytest.raises(ScenarioFileError, match=r"own.ini:2: error: .*Unable: ZeroDivisionError: of a kind"):
        run(made.scenario())


def test_a_task_that_fails_is_named(play, tmp_path):
    profile = tmp_path / "own.ini"
    profile.write_text(f"[Require otter.ini]\n[{__name__}.Faulty]\nEnabled = Simulation\n[General]\nVehicle = own\n")
    result = play("expect: [{always: SimulatedState.z < 9 m}]", "vehicle: {profile: own.ini}\n")
    assert result.error.startswith("RuntimeError: out of order (in own, ")
    assert re.search(r"Faulty at 2\.000 s of the run, [\w.]+py:\d+\)$", result.error)
    assert not result.passed
    assert result.verdicts[0].passed


class Careless(Task):
    """Publishes what no message can carry."""

    @periodic(1.0)
    def say(self):
        self.publish(imc.Depth(value="deep"))


def test_a_message_that_cannot_be_is_reported_with_the_place_of_the_task_that_made_it(play, tmp_path):
    profile = tmp_path / "own.ini"
    profile.write_text(f"[Require otter.ini]\n[{__name__}.Careless]\nEnabled = Simulation\n[General]\nVehicle = own\n")
    error = play("", "vehicle: {profile: own.ini}\n").error
    assert re.search(r"Careless at [\d.]+ s of the run, test_run\.py:\d+\)$", error), error


BROKEN = """
import sys
from pathlib import Path
from runtime.vehicle import add_task_folder
from shoal.scenarios import load_document, run

add_task_folder(Path())
result = run(load_document(Path("trial.scenario.yaml")).scenario())
print(result.passed, result.error)
"""


@pytest.mark.heavy
def test_a_broken_task_that_no_vehicle_has_stops_no_scenario(tmp_path):
    (tmp_path / "tasks/mine").mkdir(parents=True)
    (tmp_path / "tasks/mine/broken.py").write_text("import nothing_there\n")
    text = "vehicle: {profile: otter, parameters: {Simulators.GPS: {HACC: 3}}}\nlimit: 1 s\n"
    (tmp_path / "trial.scenario.yaml").write_text(text)
    done = subprocess.run([sys.executable, "-c", BROKEN], cwd=tmp_path, capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("True \n", "")


def test_a_log_that_cannot_be_written_is_reported(play, tmp_path):
    (tmp_path / "file").write_text("")
    result = play(log_root=tmp_path / "file")
    assert result.passed
    assert result.seconds == 3.0
    assert result.logs == {}
    assert len(result.warnings) == 1
    assert result.warnings[0].startswith("the log of otter is not complete: ")


def test_the_log_of_a_plan_is_reported_and_all_logs_are_hashed(play, tmp_path):
    result = play("", DIVE, log_root=tmp_path / "log")
    assert result.logs["lauv-noptilus-1"].name.endswith("_dive")
    logs = sorted((tmp_path / "log" / "lauv-noptilus-1").glob("*/*/Data.lsf.gz"))
    assert len(logs) > 2
    data = b"".join(gzip.decompress(log.read_bytes()) for log in logs)
    assert hashlib.sha256(data).hexdigest() == result.hashes["lauv-noptilus-1"]


def test_the_data_of_a_log_has_the_hash_that_is_reported(play, tmp_path):
    result = play(log_root=tmp_path / "log")
    (data,) = result.logs["otter"].glob("Data.lsf*")
    assert hashlib.sha256(gzip.decompress(data.read_bytes())).hexdigest() == result.hashes["otter"]


def test_what_is_no_number_meets_no_expectation(play):
    text = """
    events: [{at: 1 s, message: {abbrev: Depth, src: otter, value: .nan}}]
    expect:
      - {name: never, never: Depth.value > 5}
      - {name: follows, after: Depth.value != 3, within: 1 s, never: Depth.value > 5}
      - {name: never both, never: Depth.value > 5 and SimulatedState.z > 5}
    """
    result = play(text)
    assert [(v.passed, v.margin) for v in result.verdicts] == [(False, -math.inf)] * 3
    assert result.verdicts[0].reason == "failed first at 1.000 s: a value is no number"
