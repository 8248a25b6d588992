"""`shoal campaign` with a search, on a shipped vehicle: what breaks it fails again, and what it tells can be pasted."""

import shutil

import pytest

from shoal.campaigns import Job, ScenarioRunner, compute_findings, open_results, run
from tests.command import shoal

SCENARIO = """\
scenario: rest
vehicle: {profile: lauv-noptilus-1, modes: Kinematic}
world: {current: {north: 0 m/s, east: 0 m/s}}
expect:
  - {name: stays near, never: SimulatedState.x > 12 m}
metrics:
  far: {max: SimulatedState.x}
limit: 10 s
"""
STUDY = """\
scenario: rest.scenario.yaml
vary:
  world/current/north: {uniform: [-1 m/s, 1 m/s]}
  world/current/east: {uniform: [-1 m/s, 1 m/s]}
search: {minimize: margin of stays near, at a time: 3, shrink: 12}
runs: 7
seed: 3
"""


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("search")
    (folder / "rest.scenario.yaml").write_text(SCENARIO)
    (folder / "rest.study.yaml").write_text(STUDY)
    return folder


@pytest.fixture(scope="module")
def told(place):
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        done = shoal("campaign", "rest.study.yaml", "-j", 0)
    assert done.exit_code == 0, done.output
    return done.output


@pytest.fixture(autouse=True)
def there(place, monkeypatch):
    monkeypatch.chdir(place)


@pytest.mark.heavy
def test_it_tells_what_it_found(told):
    assert told.startswith("rest: 6 runs sought the smallest margin of stays near, ")
    assert "made the change smaller" in told
    assert "smallest change that does is run " in told
    assert "world/current/north = " in told
    assert "world/current/east = " not in told
    assert "shoal test campaigns/rest/rest.scenario.yaml\nshoal campaign report campaigns/rest\n" in told
    assert "Wilson" not in told


@pytest.mark.heavy
def test_what_it_found_fails_again_and_in_the_same_way(told, place):
    data = open_results(place / "campaigns" / "rest")
    smallest = compute_findings(data).smallest_failure
    file = data.folder / "rest.scenario.yaml"
    again = ScenarioRunner()(Job(0, file))
    assert not again.passed
    assert again.fingerprint == smallest["fingerprint"]
    assert -0.5 < again.margin == smallest["margin"] <= 0.0
    done = shoal("test", file, "--log-dir", place / "log")
    assert done.exit_code == 1
    assert smallest["reason"] in done.output


@pytest.mark.heavy
def test_the_report_and_a_run_again(told, place):
    done = shoal("campaign", "report", "campaigns/rest")
    assert done.exit_code == 0
    assert "smallest margin of stays near" in done.output
    smallest = compute_findings(open_results(place / "campaigns" / "rest")).smallest_failure
    done = shoal("campaign", "rerun", "campaigns/rest", "--run", smallest["run"])
    assert done.exit_code == 0
    assert f"as it was: fingerprint {smallest['fingerprint'][:16]}" in done.output


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("north: 0 m/s", "north: 0.9 m/s"), "it fails as it is: there is nothing to look for"),
        (("> 12 m", "> 300 m"), "no run fails"),
    ],
)
def test_other_endings(place, tmp_path, monkeypatch, change, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rest.scenario.yaml").write_text(SCENARIO.replace(*change))
    shutil.copy(place / "rest.study.yaml", tmp_path)
    done = shoal("campaign", "rest.study.yaml", "-j", 0, "--runs", 4)
    assert done.exit_code == 0, done.output
    assert words in done.output


def test_the_number_of_runs_cannot_be_changed(told):
    done = shoal("campaign", "rest.study.yaml", "-j", 0, "--runs", 4)
    assert done.exit_code == 2
    said = (
        "study 'rest' with 7 runs, not 4: the number of runs of a search cannot be changed; name another folder with -o"
    )
    assert said in " ".join(done.output.split())


@pytest.mark.heavy
def test_a_deprecated_key_gives_a_warning_with_file_and_line(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rest.scenario.yaml").write_text(SCENARIO)
    (tmp_path / "rest.study.yaml").write_text(STUDY.replace("minimize", "minimise").replace("runs: 7", "runs: 2"))
    done = shoal("campaign", "rest.study.yaml", "-j", 0)
    assert done.exit_code == 0, done.output
    assert "warning: rest.study.yaml:5: search: minimise is deprecated: write minimize" in done.stderr
    with pytest.warns(DeprecationWarning, match=r"rest\.study\.yaml:5: search: minimise is deprecated: write minimize"):
        run("rest.study.yaml", workers=0)


@pytest.mark.heavy
def test_parameters_are_tuned(place, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rest.scenario.yaml").write_text(SCENARIO)
    option = "vehicle/parameters/Simulators.EstimatedState/Current North"
    vary = f"{{{option}: {{uniform: [0.05, 0.2]}}}}"
    study = f"scenario: rest.scenario.yaml\nvary: {vary}\nsearch: {{maximize: metrics.far}}\nruns: 4\n"
    (tmp_path / "rest.study.yaml").write_text(study)
    done = shoal("campaign", "rest.study.yaml", "-j", 0)
    assert done.exit_code == 0, done.output
    assert f"{option} = " in done.output
    assert "campaigns/rest/tuned.ini" in done.output
    assert "[Simulators.EstimatedState]\nCurrent North = 0." in (tmp_path / "campaigns/rest/tuned.ini").read_text()
