"""`shoal campaign` on a shipped profile: runs, goes on, runs again, reports, compares; and what it says of mistakes."""

import json
import re
import subprocess
import sys

import pytest

from shoal.campaigns import open_results, run
from tests import command
from tests.outside import NO_FILE

SCENARIO = """\
scenario: rest
vehicle: {profile: lauv-noptilus-1}
world: {current: {north: 0, east: 0}}
expect:
  - {name: stays_near, always: SimulatedState.x < 3 m}
metrics:
  north: {last: SimulatedState.x}
limit: 20 s
"""
STUDY = """\
scenario: rest.scenario.yaml
vary:
  world/current/north: {uniform: [0 m/s, 0.3 m/s]}
runs: 5
seed: 3
logs: failed
"""


def shoal(*words):
    return command.shoal("campaign", *words)


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("campaign")
    (folder / "rest.scenario.yaml").write_text(SCENARIO)
    (folder / "rest.study.yaml").write_text(STUDY)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        done = shoal("rest.study.yaml", "-j", 0)
    assert done.exit_code == 0, done.output
    assert "rest: " in done.output
    assert "of 5 passed" in done.output
    return folder


@pytest.fixture(autouse=True)
def there(place, monkeypatch):
    monkeypatch.chdir(place)


@pytest.mark.heavy
def test_runs_differ_by_what_varies(place):
    frame = open_results(place / "campaigns" / "rest").data_frame()
    north = frame["values.world/current/north"]
    assert frame["metrics.north"].corr(north) > 0.9
    assert 0 < frame["passed"].sum() < 5
    assert (frame["passed"] == frame["logs.lauv-noptilus-1"].isna()).all()
    assert len(frame.loc[0, "tracks.lauv-noptilus-1"]) >= 3 * 4


@pytest.mark.heavy
def test_a_run_again_is_the_same_to_the_byte_of_its_log(place):
    frame = open_results(place / "campaigns" / "rest").data_frame()
    number = frame.index[~frame["passed"]][0]
    again = shoal("rerun", "campaigns/rest", "--run", number, "--log-dir", "again")
    assert again.exit_code == 0, again.output
    assert "as it was: fingerprint and log" in again.output
    what_if = shoal("rerun", "campaigns/rest", "--run", number, "--set", "world/current/north=0")
    assert what_if.exit_code == 0
    assert f"run {number}, seed {frame.loc[number, 'seed']}: passed" in what_if.output
    drawn = float(frame.loc[number, "values.world/current/north"])
    assert f"  world/current/north = 0 (was {drawn!r} m/s)\n" in what_if.output
    assert "  metrics.north: " in what_if.output
    assert "(was " in what_if.output.partition("metrics.north")[2]


@pytest.mark.heavy
def test_it_goes_on_where_it_was_and_compares_pairs(place):
    set_option = ("--set", "vehicle/parameters/Simulators.GPS/HACC=9")
    assert shoal("rest.study.yaml", "-j", 0, "-o", "b", "--runs", 2, *set_option).exit_code == 0
    more = shoal("rest.study.yaml", "-j", 0, "-o", "b", "--runs", 3, *set_option)
    assert "of 3 passed" in more.output
    assert re.search(r"  (1 min 00 s|[0-9.]+ s) simulated in [0-9.]+ s of CPU: ", more.output)
    assert "2 runs were done before\n" in more.output
    found = shoal("compare", "campaigns/rest", "b", "--fail-if", "pass rate < -1 %")
    assert found.exit_code == 0, found.output
    assert "not compared: 2 runs that only A has" in found.output
    assert "metrics.north" in found.output
    limit = shoal("compare", "campaigns/rest", "b", "--fail-if", "metrics.north <= 0.5")
    assert limit.exit_code == 1
    assert "limit exceeded: metrics.north changed by" in limit.output


@pytest.mark.heavy
def test_runs_that_do_not_count_are_reported(place):
    words = ("rest.study.yaml", "-j", 0, "-o", "fewer", "--runs")
    assert "more run" not in shoal(*words, 3).output
    fewer = shoal(*words, 1).output
    line = "2 more runs are in fewer, and do not count; with --runs 3 they do\n"
    assert line in fewer
    assert line in shoal("report", "fewer").output
    assert "1 more run is in fewer, and does not count; with --runs 3 it does\n" in shoal(*words, 2).output
    assert "more run" not in shoal(*words, 3).output


@pytest.mark.heavy
def test_shards_are_merged_and_what_is_missing_can_be_done(place):
    words = ("rest.study.yaml", "-j", 0, "--runs", 3, "-o", "parts")
    assert "of 2 passed" in shoal(*words, "--shard", "1/2").output
    some = shoal("merge", "parts/shard-1-of-2", "-o", "parts")
    assert some.exit_code == 1
    assert "missing: 1 of 3 runs: 1\n" in some.output
    assert "rest.study.yaml --runs 3 --logs failed -o parts does them" in some.output
    assert "of 1 passed" in shoal(*words, "--shard", "2/2").output
    whole = shoal("merge", "parts/shard-1-of-2", "parts/shard-2-of-2", "-o", "parts")
    assert whole.exit_code == 0, whole.output
    assert "of 3 passed" in whole.output
    one, other = (open_results(place / name).data_frame() for name in ("campaigns/rest", "parts"))
    assert one["fingerprint"][:3].equals(other["fingerprint"])


def test_the_report_is_a_file(place):
    made = shoal("report", "campaigns/rest")
    assert made.exit_code == 0
    text = (place / "campaigns" / "rest" / "report.html").read_text()
    assert "stays_near" in text
    assert "<h2>Tracks</h2>" in text


def test_a_notebook_gets_a_data_frame(place):
    frame = run(place / "rest.study.yaml", place / "campaigns" / "rest", workers=0)
    assert list(frame.index) == list(range(5))


@pytest.mark.heavy
def test_a_scenario_inside_the_study_is_the_same(place):
    inside = "\n".join(
        f"  {line}" for line in SCENARIO.replace("north: 0,", "north: {uniform: [0, 0.3]},").splitlines()
    )
    (place / "whole.study.yaml").write_text(f"scenario:\n{inside}\nruns: 5\nseed: 3\n")
    done = shoal("whole.study.yaml", "-j", 0, "-o", "whole")
    assert done.exit_code == 0, done.output
    one, other = (open_results(place / name).data_frame() for name in ("campaigns/rest", "whole"))
    assert one["fingerprint"].equals(other["fingerprint"])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ["rest.study.yaml", "--set", "wrold/current/north=1"],
            "Error: --set wrold/current/north=1: unknown key 'wrold'",
        ),
        (["rest.study.yaml", "--set", "limit=abc"], "Error: --set limit=abc: 'abc' is not a duration"),
        (["rest.study.yaml", "--set", "seed=abc"], "Error: --set seed=abc: expected a whole number"),
        (["rest.study.yaml", "--set", "world"], "'world' is no assignment"),
        (["absent.study.yaml"], f"absent.study.yaml: {NO_FILE}"),
        (["raport", "x"], "no such command: raport. Did you mean report?"),
        (["rerun", "campaigns/rest", "--run", "9"], "campaigns/rest has no run 9; it has runs 0 to 4"),
        (
            ["rest.study.yaml", "--shard", "0/4"],
            "'0/4' is not a shard such as 3/16, the third of sixteen; the first is 1",
        ),
        (["merge", ".", "-o", "out"], ". is not the data set of a campaign"),
        (["merge", "campaigns/rest"], "--out"),
        (["report", "."], ". is not the data set of a campaign"),
        (["compare", "campaigns/rest", "campaigns/rest", "--fail-if", "x"], "'x' is not a limit"),
        (["rest.study.yaml", "-o", "campaigns/rest", "--set", "vehicle/seed=4"], "has runs of another study"),
    ],
)
def test_mistakes_are_one_line_and_status_2(words, said):
    done = shoal(*words)
    assert done.exit_code == 2, done.output
    assert said in done.output.replace("\n", " ")
    assert "Traceback" not in done.output


def test_what_the_vehicle_has_not_got_is_reported_before_any_run(place):
    events = "events: [{at: 1 s, leak: Bow}]\n"
    (place / "leak.scenario.yaml").write_text(SCENARIO + events)
    (place / "leak.study.yaml").write_text(STUDY.replace("rest.", "leak."))
    done = shoal("leak.study.yaml", "-o", "leak")
    assert done.exit_code == 2, done.output
    assert "leak.scenario.yaml:9: there is no leak sensor 'Bow'" in done.output.replace("\n", " ")
    assert not (place / "leak").exists()


def test_a_choice_that_the_vehicle_has_not_got_is_reported_before_any_run(place):
    events = "events: [{at: 1 s, silent: Simulators.GPS}]\n"
    (place / "choice.scenario.yaml").write_text(SCENARIO + events)
    study = "scenario: choice.scenario.yaml\nvary:\n  events/0/silent: {choice: [Simulators.GPS, Simulators.GPSS]}\n"
    (place / "choice.study.yaml").write_text(study)
    done = shoal("choice.study.yaml", "-o", "choice")
    assert done.exit_code == 2, done.output
    assert "choice.study.yaml:3: events/0/silent = Simulators.GPSS: " in done.output.replace("\n", " ")
    assert not (place / "choice").exists()


@pytest.mark.heavy
def test_without_the_extra_it_says_what_to_install(place):
    code = "import sys; sys.modules['scipy'] = None; sys.modules['pyarrow'] = None\nfrom shoal.cli import main; main()"
    words = [sys.executable, "-c", code, "campaign", "rest.study.yaml", "-o", "none", "-j", "0"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "this needs pyarrow: pip install 'shoal[campaigns]'" in done.stderr


def test_the_table_says_what_it_is_of(place):
    import pyarrow.parquet

    about = pyarrow.parquet.read_schema(place / "campaigns" / "rest" / "runs.parquet").metadata
    assert json.loads(about[b"varied"]) == {"world/current/north": "uniform: [0 m/s, 0.3 m/s]"}
    assert json.loads(about[b"units"]) == {"world/current/north": "m/s"}


@pytest.mark.parametrize("moment", ["load_study", "run_study"])
def test_ctrl_c_before_the_first_run_ends_it_with_130(place, monkeypatch, moment):
    def interrupt(*_, **__):
        (place / "early").mkdir(exist_ok=True)
        (place / "early" / "runs.journal").touch()
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(f"shoal.cli.campaign.run.{moment}", interrupt)
        done = shoal("rest.study.yaml", "-o", "early")
    assert (done.exit_code, done.output.split("\n")[0].partition(":")[0]) == (130, "stopped")
    assert "of 1 passed" in shoal("rest.study.yaml", "-j", 0, "-o", "early", "--runs", 1).output
