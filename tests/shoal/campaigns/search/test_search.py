"""Searches: what they find, how small they make it, that nothing but the study decides it, and what they refuse."""

import math
import re
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

from shoal.campaigns import Shard, campaign_html, compute_findings, open_results, repeat_run, run
from shoal.campaigns.results.store import CampaignResults, ResultsError
from shoal.campaigns.sampling.distributions import StudyFileError, parse_distribution
from shoal.campaigns.search.config import SearchConfig
from shoal.campaigns.search.objective import SearchObjective
from shoal.campaigns.search.schedule import SearchSchedule
from shoal.campaigns.search.search_space import make_axis
from shoal.campaigns.studies.study import load_study
from shoal.campaigns.study_execution import run_study
from shoal.scenarios import ExpectationVerdict, ScenarioResult, load_document
from support.located_yaml import parse_yaml_tree
from tests.shoal.campaigns.search.slope import GPS, NORTH, SCENARIO, STUDY, Dead, Slope, do, write
from tests.shoal.campaigns.standin import comparable

ROOT = Path(__file__).parents[4]


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    folder = tmp_path_factory.mktemp("search")
    return do(write(folder), folder / "runs")


@pytest.mark.heavy
def test_it_finds_what_breaks_a_scenario_and_the_smallest_change_that_does(found):
    shown = compute_findings(found)
    assert shown.baseline["run"] == 0
    assert shown.objective.value(shown.baseline) == pytest.approx(0.313)
    assert [row["run"] for row in shown.trials] == list(range(1, 30))
    assert shown.objective.value(shown.best) < -0.45  # -0.6 is the least there is
    assert shown.best_so_far[-1] == shown.objective.value(shown.best)
    assert len(shown.best_so_far) == len(found.rows)
    all_values = map(shown.objective.value, found.counted_rows)  # also of those made smaller
    assert shown.objective.value(shown.best) == min(all_values)
    assert list(shown.best_so_far) == sorted(shown.best_so_far, reverse=True)
    [(place, north)] = shown.changed_values_of_run(shown.smallest_failure).items()
    assert place == NORTH
    assert 0.413 <= north < 0.43
    assert len(found.rows) <= 30 + 40
    assert found.end == len(found.rows)
    assert {row["seed"] for row in found.counted_rows} == {3}  # that of the scenario


def test_what_it_found_is_a_scenario_that_says_why(found):
    path = found.folder / "dive.scenario.yaml"
    shown = compute_findings(found)
    text = path.read_text()
    north = shown.changed_values_of_run(shown.smallest_failure)[NORTH]
    assert "# Found by a search of dive.study.yaml.\n# margin of stays: -" in text
    assert f"# {NORTH} = {north:g} m/s, instead of 0.1 m/s\n" in text
    assert text.count("instead of") == 1
    scenario = load_document(path).scenario()
    assert scenario.name == "dive"
    assert scenario.seed == 3
    speeds = [s.value for s in scenario.vehicles[0].settings if s.option == "Current North"]
    assert speeds == [repr(float(north))]


@pytest.mark.heavy
def test_it_is_the_same_for_any_number_of_workers(found, tmp_path):
    two = do(write(tmp_path), tmp_path / "runs", workers=2)
    assert comparable(two) == comparable(found)
    name = "dive.scenario.yaml"
    assert (tmp_path / "runs" / name).read_bytes() == (found.folder / name).read_bytes()


SCRIPT = """
import sys, time
from functools import partial
from pathlib import Path
from tests.shoal.campaigns.search.slope import Slope, run_study, load_study
def slow(data):
    print(len(data.rows), flush=True)
    time.sleep(0.005)
folder = Path(sys.argv[1])
study = load_study(folder / "dive.study.yaml")
run_study(study, folder / "runs", make_runner=partial(Slope, folder / "count"), workers=0, on_progress=slow)
"""


@pytest.mark.heavy
def test_killed_at_any_moment_it_goes_on_and_does_nothing_twice(found, tmp_path):
    """In the first trials, in the middle of a batch, and while the change is made smaller."""
    write(tmp_path)
    command = [sys.executable, "-c", SCRIPT, str(tmp_path)]
    kills = (2, 20, 33)
    for done in kills:
        with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
            while int(process.stdout.readline()) < done:
                pass
            process.send_signal(signal.SIGKILL)
            process.communicate()
    subprocess.run(command, cwd=ROOT, stdout=subprocess.DEVNULL, check=True)
    data = open_results(tmp_path / "runs")
    assert comparable(data) == comparable(found)
    counted = (tmp_path / "count").read_text().split()
    assert set(map(int, counted)) == set(found.rows)
    assert len(counted) <= len(found.rows) + len(kills)  # at most the runs in which it was killed


def test_a_search_that_is_over_does_nothing_again(found, tmp_path):
    count = tmp_path / "count"
    again = do(found.folder.parent / "dive.study.yaml", found.folder, make=partial(Slope, count))
    assert not count.exists()
    assert comparable(again) == comparable(found)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("shrink: 40", "shrink: 39"), "has runs of another study, 'dive'"),
        (("of stays", ""), "has runs of another study, 'dive'"),
        (("runs: 30", "runs: 31"), "30 runs, not 31: the number of runs of a search cannot be changed"),
    ],
)
def test_a_folder_of_another_search_is_refused(found, tmp_path, change, words):
    path = write(tmp_path, STUDY.replace(*change))
    with pytest.raises(ResultsError, match=words):
        do(path, found.folder)


def test_a_run_of_a_search_is_done_again(found):
    shown = compute_findings(found)
    again = repeat_run(found, shown.smallest_failure["run"], Slope())
    assert not again.differences
    assert again.values == {NORTH: f"{shown.changed_values_of_run(shown.smallest_failure)[NORTH]!r} m/s"}


@pytest.mark.heavy
def test_the_page_has_no_pass_rate(found):
    page = campaign_html(found, found.folder)
    assert "Smallest margin of stays" in page
    assert "Best so far" in page
    assert "smallest change that fails" in page
    assert "Wilson" not in page
    assert "pass rate" not in page.lower()
    assert "worst run" not in page
    assert "runs done" not in page
    few = CampaignResults(found.folder, found.metadata, {run: found.rows[run] for run in range(4)})
    assert "4 of 30 runs done" in campaign_html(few, found.folder)


@pytest.mark.heavy
@pytest.mark.parametrize(("goal", "kind"), [("minimize", "smallest"), ("maximize", "largest")])
def test_the_page_lists_the_best_runs(tmp_path, goal, kind):
    text = STUDY.replace("minimize: margin of stays, shrink: 40", f"{goal}: metrics.far")
    data = do(write(tmp_path, text), tmp_path / "runs")
    _, _, part = campaign_html(data, data.folder).partition(f"<h2>The 20 runs with the {kind} metrics.far</h2>")
    listed = re.findall(r'<tr><td class="n">(\d+)</td><td class="n">([^<]+)</td>', part)
    assert int(listed[0][0]) == compute_findings(data).best["run"]
    values = [float(value) for _, value in listed]
    assert len(values) == 20
    assert values == sorted(values, reverse=goal == "maximize")


@pytest.mark.parametrize(
    ("place", "before", "vary", "default"),
    [
        (NORTH, "north: 0.1", "[-1 m/s, 1 m/s]", 0.1),
        (NORTH, "north: 0.1 m/s", "[-1, 1]", 0.1),
        (GPS, "north: 0.1 m/s", "[1 m, 9 m]", 2.0),
        ("events/0/at", "north: 0.1 m/s", "[1 s, 9 s]", 5.0),
        ("events/0/at", "north: 0.1 m/s", "[0.1 min, 0.2 min]", None),
    ],
)
def test_a_value_without_a_unit_is_in_that_of_the_study(tmp_path, place, before, vary, default):
    scenario = SCENARIO.replace("north: 0.1 m/s", before) + "events: [{at: 5, silent: Simulators.GPS/Kinematic}]\n"
    text = f"scenario: dive.scenario.yaml\nvary: {{{place}: {{uniform: {vary}}}}}\nsearch: {{minimize: metrics.far}}\n"
    write(tmp_path, text)
    (tmp_path / "dive.scenario.yaml").write_text(scenario)
    assert load_study(tmp_path / "dive.study.yaml", has_begun=True).search.axes[place].default == default


@pytest.mark.heavy
def test_the_best_parameters_are_options_of_a_profile(tmp_path):
    text = STUDY.replace("minimize: margin of stays, shrink: 40", "minimize: metrics.far")
    data = do(write(tmp_path, text), tmp_path / "runs")
    shown = compute_findings(data)
    assert shown.best["passed"]  # north below -0.9 would be better, but does not dive
    assert shown.changed_values_of_run(shown.best)[NORTH] > -0.9
    assert shown.smallest_failure is None
    chosen = shown.changed_values_of_run(shown.best)[GPS]
    ini = (tmp_path / "runs" / "tuned.ini").read_text()
    assert ini.endswith(f"[Simulators.GPS]\nHACC = {chosen}\n")
    assert "# metrics.far: " in ini
    assert f"{GPS} = {chosen}, instead of " in ini
    own = SCENARIO.replace("lauv-noptilus-1", "mine.ini").replace("seed: 3\n", "")
    (tmp_path / "mine.ini").write_text("[Require lauv-noptilus-1.ini]\n[Require runs/tuned.ini]\n")
    (tmp_path / "own.scenario.yaml").write_text(own)
    assert load_document(tmp_path / "own.scenario.yaml").current_value(GPS) == chosen
    everything = do(write(tmp_path, text.replace("metrics.far", "metrics.far, of: all")), tmp_path / "all")
    assert compute_findings(everything).objective.value(compute_findings(everything).best) < shown.objective.value(
        shown.best
    )


def test_a_gain_in_a_list_is_tuned(tmp_path):
    gain = "vehicle/parameters/Control.AUV.Attitude/Heading PID Gains/0"
    gains = "Control.AUV.Attitude: {Heading PID Gains: [1.5, 0, 0.15]}, Control.Path"
    text = SCENARIO.replace("modes: Kinematic", "modes: Simulation").replace("Control.Path", gains)
    study = (
        f"scenario: dive.scenario.yaml\nvary: {{{gain}: {{uniform: [0.5, 3]}}}}\nsearch: {{minimize: metrics.far}}\n"
    )
    data = do(write(tmp_path, study, text), tmp_path / "runs", make=partial(Slope, gain=gain), runs=4)
    [(place, best)] = compute_findings(data).changed_values_of_run(compute_findings(data).best).items()
    assert place == gain
    assert compute_findings(data).default_scenario_value(gain) == 1.5
    ini = (tmp_path / "runs" / "tuned.ini").read_text()
    assert ini.endswith(f"[Control.AUV.Attitude]\nHeading PID Gains = {best}, 0, 0.15\n")


def test_a_scenario_that_fails_as_it_is_leaves_nothing_to_look_for(tmp_path):
    data = do(write(tmp_path, scenario=SCENARIO.replace("0.1 m/s", "0.5 m/s")), tmp_path / "runs", make=Failing)
    assert [row["part"] for row in data.counted_rows] == ["as it is"]
    assert compute_findings(data).changed_values_of_run(compute_findings(data).smallest_failure) == {}


class Failing(Slope):
    """Fails whatever the values are."""

    def __call__(self, job):
        return ScenarioResult("dive", job.seed, (ExpectationVerdict("stays", False, -0.1, "failed"),))


def test_what_ends_with_an_error_is_no_finding_about_one_expectation(tmp_path):
    data = do(write(tmp_path), tmp_path / "runs", make=partial(Slope, dead=True))
    shown = compute_findings(data)
    assert math.isnan(shown.objective.value(data.rows[4]))
    assert data.rows[4] not in shown.failures
    assert shown.smallest_failure is not None


@pytest.mark.heavy
def test_all_combinations_are_tried_once_and_then_it_ends(tmp_path):
    text = f"scenario: dive.scenario.yaml\nvary: {{{GPS}: {{choice: [3, 2, 7]}}}}\nsearch: {{minimize: metrics.far}}\n"
    data = do(write(tmp_path, text), tmp_path / "runs")
    assert sorted(row[f"values.{GPS}"] for row in data.counted_rows[1:]) == [3, 7]  # 2 is that of the scenario
    assert compute_findings(data).best[f"values.{GPS}"] == 7


def test_the_order_in_which_runs_end_does_not_matter():
    """Rows come in backwards within each batch, and a second search goes on from the rows of half of the first."""

    def rows_of(order, rows):
        course = SearchSchedule(search, 40, 9, rows)
        for runs in course.batches():
            for number in order(list(runs)):
                values = course.raw_values(number)
                margin = 0.5 - values.get("x", 0.0)
                row = {
                    "run": number,
                    "error": "",
                    "passed": margin > 0.0,
                    "margin": margin,
                    **course.extra_columns(number),
                }
                rows[number] = {**row, **{f"values.{place}": value for place, value in values.items()}}
        return rows

    node = parse_yaml_tree("{uniform: [-1, 1]}", "s.yaml", StudyFileError)
    axes = {place: make_axis(place, parse_distribution(node), 0.0) for place in "xy"}
    search = SearchConfig(SearchObjective("margin", "margin", is_maximized=False, only_passed=False), axes, seed=0)
    whole = rows_of(lambda runs: runs, {})
    assert rows_of(lambda runs: runs[::-1], {}) == whole
    half = {number: row for number, row in whole.items() if number % 2 or number < 7}
    assert rows_of(lambda runs: runs, half) == whole
    smallest = min((row for row in whole.values() if row["margin"] <= 0.0), key=lambda row: abs(row["values.x"]))
    assert "values.y" not in smallest
    assert 0.5 <= smallest["values.x"] < 0.52


def test_without_optuna_it_says_so_before_any_run(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "optuna", None)
    count = tmp_path / "count"
    with pytest.raises(ModuleNotFoundError, match=r"this needs optuna: pip install 'shoal\[campaigns\]'"):
        do(write(tmp_path), tmp_path / "runs", make=partial(Slope, count))
    assert not count.exists()


def test_optuna_says_nothing(tmp_path, capfd):
    do(write(tmp_path), tmp_path / "runs")
    assert capfd.readouterr() == ("", "")


def test_another_optuna_does_not_go_on(found, monkeypatch):
    monkeypatch.setattr("shoal.campaigns.search.config.version", lambda _: "99")
    with pytest.raises(ResultsError, match=r"another version: .*optuna \d.*, others with .*optuna 99"):
        do(found.folder.parent / "dive.study.yaml", found.folder)


@pytest.mark.heavy
def test_paths_in_what_it_writes_lead_to_the_same_files(tmp_path):
    """A study elsewhere than its data set; the profile and the plan are beside the scenario."""
    (tmp_path / "mine.ini").write_text("[Require lauv-noptilus-1.ini]\n")
    plan = "plan: out\norigin: 41.185°, -8.7062°\nmaneuvers:\n  - goto: {north: 80, east: 20}\n"
    (tmp_path / "out.yaml").write_text(plan)
    text = SCENARIO.replace("lauv-noptilus-1", "mine").replace("  modes", "  plan: out.yaml\n  modes")
    data = do(write(tmp_path, scenario=text), tmp_path / "deep" / "er" / "runs")
    first = load_document(tmp_path / "dive.scenario.yaml").scenario().vehicles[0]
    found = load_document(data.folder / "dive.scenario.yaml").scenario().vehicles[0]
    assert Path(found.profile).resolve() == (tmp_path / "mine.ini").resolve()
    assert found.plan.replace(timestamp=0.0) == first.plan.replace(timestamp=0.0)


def test_a_search_has_no_shards(tmp_path):
    study = load_study(write(tmp_path))
    with pytest.raises(ValueError, match="search: it cannot run as shard 2/3"):
        run_study(study, tmp_path / "runs", make_runner=Slope, workers=0, shard=Shard(2, 3))
    assert not (tmp_path / "runs").exists()


@pytest.mark.heavy
def test_nothing_is_written_of_a_scenario_that_has_changed_meanwhile(tmp_path):
    path = write(tmp_path)

    def change(_):
        (tmp_path / "dive.scenario.yaml").write_text(SCENARIO.replace("20 s", "21 s"))

    with pytest.raises(ResultsError, match=r"dive.study.yaml, or a file that it names, has changed"):
        run_study(load_study(path), tmp_path / "runs", make_runner=Slope, workers=0, on_progress=change)
    assert not (tmp_path / "runs" / "dive.scenario.yaml").exists()
    (tmp_path / "dive.scenario.yaml").write_text(SCENARIO)
    do(path, tmp_path / "runs", make=Dead)  # it has all runs
    assert (tmp_path / "runs" / "dive.scenario.yaml").exists()


@pytest.mark.heavy
def test_a_search_gives_a_frame(tmp_path):
    text = STUDY.replace("runs: 30", "runs: 3").replace("shrink: 40", "at a time: 2")
    study = write(tmp_path, text, SCENARIO.replace("< 3 m", "< 90 m"))
    frame = run(study, tmp_path / "runs", workers=0)
    assert list(frame["part"])[:3] == ["as it is", "trial", "trial"]
    assert math.isnan(frame.loc[0, f"values.{NORTH}"])
