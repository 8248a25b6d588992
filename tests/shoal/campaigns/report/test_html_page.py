"""The page of a campaign says what mattered, and needs nothing but itself."""

import math
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from scipy.stats import kruskal

from shoal.campaigns.report.html_page import campaign_html
from shoal.campaigns.report.sensitivity import (
    eta_squared,
    group_rows_by_choice,
    input_arrays,
    output_arrays,
    rank_correlations,
    sobol_indices,
)
from shoal.campaigns.results.append_log import AppendLog
from shoal.campaigns.results.store import CampaignResults, ResultsError, open_results
from shoal.campaigns.sampling.design import SamplingDesign
from shoal.campaigns.sampling.distributions import StudyFileError, parse_distribution
from shoal.campaigns.studies.study import load_study
from shoal.campaigns.study_execution import run_study
from support.located_yaml import parse_yaml_tree
from tests.shoal.campaigns.standin import STUDY, StandInDraft, StandInRuns, write_study


class Reading(HTMLParser):
    """All text, links and tags of a page; fails at a tag that is not closed."""

    def __init__(self, page):
        super().__init__()
        self.text, self.links, self.tags, self._open = "", [], [], []
        self.feed(page)
        assert not self._open

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.links += [value for name, value in attrs if name in ("href", "src", "xlink:href")]
        if tag not in ("meta", "img", "br", "path", "use", "rect"):
            self._open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        if tag in self._open:
            assert self._open.pop() == tag

    def handle_data(self, data):
        self.text += data


class Swimming(StandInRuns):
    """With a track, and a name that is not safe in HTML."""

    def __call__(self, job):
        result = super().__call__(job)
        points = [41.0, -8.0, 0.0, 41.0 + 1e-3 * result.metrics["drift"], -8.0, 2.0, 41.001, -8.001, 1.0]
        result.tracks["lauv"] = points
        result.metrics["<script>"] = result.metrics["drift"] ** 2
        return result


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    path = write_study(folder, STUDY.replace("runs: 40", "runs: 150") + "logs: failed\ndescription: a & <b>\n")
    return run_study(load_study(path, make_draft=StandInDraft), folder / "runs", make_runner=Swimming, workers=0)


@pytest.mark.heavy
def test_the_page_says_all_and_needs_no_network(data):
    page = campaign_html(data, data.folder)
    read = Reading(page)
    low, high = data.pass_rate.interval
    assert f"{low:.1%} to {high:.1%}" in read.text
    for words in ("150", "world/current/north", "stays_near", "metrics.drift", "<script>", "a & <b>", "Wilson"):
        assert words in read.text
    assert "script" not in {tag for tag, _ in read.tags}
    sections = re.findall(r"<h2>(.*?)</h2>", page)
    assert sections == [
        *("Expectations", "Pass rate over what varies, %", "Metrics and margins", "Rank correlation"),
        *("Sobol indices", "Strongest relations", "Tracks", "The 20 worst runs"),
    ]
    logs = [link for link in read.links if link.startswith("logs/")]
    assert len(logs) == min(20, data.pass_rate.runs - data.pass_rate.passed) > 3
    assert all((data.folder / link / "Data.lsf").is_file() for link in logs)
    assert all(link.startswith(("logs/", "data:", "#")) for link in read.links)
    worst = min(data.counted_rows, key=lambda row: row["margin"])
    assert read.text.index(f"{worst['margin']:.4g}") > 0
    assert f"--run {sorted(data.counted_rows, key=lambda row: row['margin'])[19]['run']}" not in logs


@pytest.mark.heavy
def test_a_choice_is_reported_by_what_was_drawn(data):
    sensors = ("DVL", "<GPS>", "IMU")
    rows = {run: row | {"values.events/0/silent": sensors[run % 3]} for run, row in data.rows.items()}
    for run, row in rows.items():
        row["metrics.drift"] = 10.0 * (run % 3) + row["metrics.drift"]
    chosen = CampaignResults(data.folder, data.metadata, rows, end=data.end)
    groups = group_rows_by_choice(chosen.counted_rows)["values.events/0/silent"]
    assert {word: len(places) for word, places in groups.items()} == {"<GPS>": 50, "DVL": 50, "IMU": 50}
    text = Reading(campaign_html(chosen, data.folder)).text
    table = text[text.index("Choices") : text.index("Metrics and margins")]
    of_gps = [row for run, row in rows.items() if run % 3 == 1]
    share = len([row for row in of_gps if row["passed"]]) / 50
    assert re.search(rf"<GPS>50{share:.1%}", table)
    assert f"{np.median([row['metrics.drift'] for row in of_gps]):.4g}" in table


def test_groups_are_parted_if_they_do_not_overlap():
    rng = np.random.default_rng(1)
    groups = np.array_split(np.arange(300), 3)
    alike = rng.normal(size=300)
    apart = alike + np.repeat([0.0, 100.0, 200.0], 100)
    assert eta_squared(groups, alike) < 0.05
    assert eta_squared(groups, apart) == pytest.approx(8 / 9, abs=1e-3)
    found = kruskal(*(alike[group] for group in groups))
    assert eta_squared(groups, alike) == pytest.approx(found.statistic / 299)
    assert math.isnan(eta_squared(groups, np.full(300, np.nan)))
    assert math.isnan(eta_squared(groups, np.ones(300)))


def test_tracks_survive_the_data_set(data):
    again = open_results(data.folder)
    track = again.data_frame().loc[3, "tracks.lauv"].reshape(-1, 3)
    assert track[2] == pytest.approx([41.001, -8.001, 1.0], abs=1e-9)
    assert track[1, 0] == pytest.approx(41.0 + 1e-3 * again.rows[3]["metrics.drift"], abs=1e-7)


@pytest.mark.heavy
def test_a_page_without_a_run_is_refused_and_one_with_few_is_drawn(tmp_path, data):
    with pytest.raises(ResultsError, match="has no run yet"):
        campaign_html(CampaignResults(tmp_path, data.metadata), tmp_path)
    few = CampaignResults(data.folder, data.metadata, {run: data.rows[run] for run in range(2)})
    read = Reading(campaign_html(few, tmp_path))
    assert "2 of 150 runs done" in read.text
    assert "Rank correlation" not in read.text
    until = CampaignResults(data.folder, {**data.metadata, "until": True}, few.rows)
    assert "2 of at most 150 runs done" in Reading(campaign_html(until, tmp_path)).text
    assert all(link.startswith(("file:///", "data:", "#")) for link in read.links)


def test_a_page_of_errors_alone_groups_them(tmp_path, data):
    about = {**data.metadata, "varied": {}, "units": {}}
    head = {"passed": False, "margin": math.nan, "reason": "", "warnings": "", "seconds": 1.0, "cpu": 1.0}
    with AppendLog(tmp_path / "runs.journal") as journal:
        journal.append(about)
        for run in range(30):
            words = "Traceback\nZeroDivisionError: <of> a kind" if run % 3 else "no plan"
            journal.append({"run": run, "seed": run, **head, "error": words, "versions": "", "fingerprint": ""})
    read = Reading(campaign_html(open_results(tmp_path), tmp_path))
    assert "201ZeroDivisionError: <of> a kind" in read.text  # runs, the first, why
    assert "100no plan" in read.text


def ishigami(sampling, runs, noise=0.0):
    """Runs of Ishigami's function, whose indices are known: 0.314, 0.442, 0 alone, 0.558, 0.442, 0.244 in total.

    `noise` is the standard deviation of what the seed adds; `coin` depends on the seed alone.
    """
    text = f"{{uniform: [{-math.pi}, {math.pi}]}}"
    varied = {name: parse_distribution(parse_yaml_tree(text, "s", StudyFileError)) for name in "abc"}
    design, rows = SamplingDesign(varied, sampling, 3, runs), []
    for run in range(runs):
        a, b, c = design.raw_values(run).values()
        y = math.sin(a) + 7.0 * math.sin(b) ** 2 + 0.1 * c**4 * math.sin(a)
        seed = design.run_seed(run)
        of_seed = np.random.default_rng(seed)
        y += noise * of_seed.standard_normal()
        drawn = {"values.a": a, "values.b": b, "values.c": c}
        rows.append({"run": run, "seed": seed, "metrics.y": y, "metrics.coin": of_seed.random() > 0.5, **drawn})
    return {"sampling": sampling, "varied": dict.fromkeys("abc", "uniform: []")}, rows


def test_sobol_indices_are_those_that_are_known(tmp_path):
    about, rows = ishigami("saltelli", 5 * 512)
    found = sobol_indices(CampaignResults(tmp_path, about), rows, output_arrays(rows))
    for name, first, total in (("a", 0.3139, 0.5576), ("b", 0.4424, 0.4424), ("c", 0.0, 0.2437)):
        index = found[f"values.{name}", "metrics.y"]
        assert index.first_order == pytest.approx(first, abs=0.05)
        assert index.total_order == pytest.approx(total, abs=0.05)
    about, rows = ishigami("random", 2000)
    found = sobol_indices(CampaignResults(tmp_path, about), rows, output_arrays(rows))
    assert found["values.b", "metrics.y"].first_order == pytest.approx(0.4424, abs=0.06)
    assert math.isnan(found["values.b", "metrics.y"].total_order)
    rows[5]["metrics.y"] = math.nan
    assert sobol_indices(CampaignResults(tmp_path, about), rows[:90], output_arrays(rows[:90])) == {}


def test_noise_between_runs_is_no_effect_of_an_input(tmp_path):
    about, rows = ishigami("saltelli", 5 * 1024, noise=3.0)
    found = sobol_indices(CampaignResults(tmp_path, about), rows, output_arrays(rows))
    variance = 13.845  # of Ishigami's function with 7 and 0.1
    for name, total in (("a", 0.5576), ("b", 0.4424), ("c", 0.2437)):
        noisy = found[f"values.{name}", "metrics.y"]
        assert noisy.total_order == pytest.approx(total * variance / (variance + 9.0), abs=0.04)
        assert found[f"values.{name}", "metrics.coin"].total_order == 0.0
    for row in rows:
        row["seed"] = row["run"]
    assert sobol_indices(CampaignResults(tmp_path, about), rows, output_arrays(rows)) == {}


def test_correlations_leave_out_what_was_not_measured():
    rows = [{"run": i, "values.x": float(i), "metrics.y": -float(i**3), "metrics.z": math.nan} for i in range(30)]
    rows[4]["metrics.y"] = math.inf
    rows[5]["metrics.y"] = None
    rows[6]["metrics.z"] = 1.0
    found = rank_correlations(input_arrays(rows), output_arrays(rows))
    assert found == {("values.x", "metrics.y"): (pytest.approx(-1.0), 28)}
    assert np.isnan(output_arrays(rows)["metrics.y"][5])
