"""Two campaigns on the same draws are compared in pairs, and one run is done again as it was."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shoal.campaigns.comparison import NotComparable, compare_campaigns, mcnemar_p_value
from shoal.campaigns.jobs.job import UnfinishedResult
from shoal.campaigns.rerun import reload_study, repeat_run
from shoal.campaigns.results.store import CampaignResults, ResultsError, open_results
from shoal.campaigns.studies.study import load_study
from shoal.campaigns.study_execution import run_study
from tests.command import shoal
from tests.shoal.campaigns.standin import STUDY, StandInDraft, StandInRuns, write_study


class Shifted(StandInRuns):
    """The vehicle drifts 0.2 m more."""

    def __call__(self, job):
        result = super().__call__(job)
        kept, *rest = result.verdicts
        kept = replace(kept, margin=kept.margin - 0.2, passed=kept.margin > 0.2)
        metrics = {"drift": result.metrics["drift"] + 0.2 + 1e-4 * (int(job.key) % 3)}
        return replace(result, verdicts=(kept, *rest), metrics=metrics)


def do(study, folder, make=StandInRuns):
    return run_study(load_study(study, make_draft=StandInDraft), folder, make_runner=make, workers=0)


@pytest.fixture
def pair(tmp_path):
    study = write_study(tmp_path)
    return do(study, tmp_path / "a"), do(study, tmp_path / "b", Shifted)


def test_differences_are_of_pairs_so_that_small_ones_show(pair):
    found = compare_campaigns(*pair)
    drift = next(change for change in found.changes if change.name == "metrics.drift")
    assert drift.runs == 40
    assert 0.2 < drift.low < drift.mean < drift.high < 0.2003
    assert (drift.fell, drift.rose) == (0, 40)
    assert found.changes[0].name == "margins.stays_near"
    assert not [change for change in found.changes if change.name in ("margins.ends_well", "metrics.never")]
    newly = {run for run in range(40) if pair[0].rows[run]["passed"] and not pair[1].rows[run]["passed"]}
    assert newly
    assert {each.a["run"] for each in found.broken} == newly
    assert not found.repaired
    assert found.rate_change.mean == pytest.approx(-len(newly) / 40)
    assert found.rate_change.low < found.rate_change.mean < found.rate_change.high
    assert found.p_value == pytest.approx(2 * 0.5 ** len(newly))


def test_limits_decide_for_ci(pair):
    found = compare_campaigns(*pair)
    assert "pass rate changed by -" in found.describe_exceeded_limit("pass rate < -2 %")
    assert found.describe_exceeded_limit("metrics.drift > 0.1").endswith("metrics.drift > 0.1")
    assert found.describe_exceeded_limit("metrics.drift > 20 %")
    assert not found.describe_exceeded_limit("metrics.drift > 0.3")
    assert not compare_campaigns(pair[0], pair[0]).describe_exceeded_limit("pass rate < -2 %")
    with pytest.raises(NotComparable, match=r"did you mean 'metrics\.drift'"):
        found.describe_exceeded_limit("metrics.drfit > 1")
    with pytest.raises(NotComparable, match="is not a limit"):
        found.describe_exceeded_limit("drift")


@pytest.mark.heavy
@pytest.mark.computing
def test_a_limit_of_the_interval_is_seldom_exceeded_by_chance():
    """A thousand comparisons of equal campaigns of 200 runs, in which a tenth of the verdicts differ by chance."""
    rng, alarms = np.random.default_rng(4), {"pass rate < -1 %": 0, "interval of pass rate < 0": 0}
    for _ in range(1000):
        outcomes = rng.random((200, 2)) < 0.95
        rows = [
            {run: {"run": run, "seed": run, "passed": bool(passed), "margin": 1.0} for run, passed in enumerate(side)}
            for side in outcomes.T
        ]
        about = {"sampling": "random"}
        found = compare_campaigns(*(CampaignResults(Path(name), about, rows[k]) for k, name in enumerate("ab")))
        for limit in alarms:
            alarms[limit] += bool(found.describe_exceeded_limit(limit))
    assert alarms["pass rate < -1 %"] > 200
    assert alarms["interval of pass rate < 0"] < 40


def test_the_interval_decides_for_ci_if_it_is_asked_for(tmp_path, pair):
    found = compare_campaigns(*pair)
    drift = next(change for change in found.changes if change.name == "metrics.drift")
    limit = f"metrics.drift > {0.5 * (drift.low + drift.mean)}"
    assert found.describe_exceeded_limit(limit)
    assert found.describe_exceeded_limit(f"interval of metrics.drift > {drift.low - 1e-6}")
    assert not found.describe_exceeded_limit(f"interval of metrics.drift > {drift.low + 1e-6}")
    with pytest.raises(NotComparable, match=r"did you mean 'metrics\.drift'"):
        found.describe_exceeded_limit("interval of metrics.drfit > 1")
    study = write_study(tmp_path / "s", f"{STUDY}sampling: sobol\n")
    even = compare_campaigns(do(study, tmp_path / "x"), do(study, tmp_path / "y", Shifted))
    assert even.describe_exceeded_limit("metrics.drift > 0.1")
    with pytest.raises(NotComparable, match="no interval, since the runs of sampling sobol are not independent"):
        even.describe_exceeded_limit("interval of metrics.drift > 0.1")
    said = shoal("campaign", "compare", str(tmp_path / "x"), str(tmp_path / "y"))
    assert said.exit_code == 0
    assert "points, no interval, since the runs of sampling sobol are not independent" in said.output
    assert "nan" not in said.output
    assert "Wilson" not in said.output


def test_runs_that_are_no_pairs_are_refused(tmp_path, pair):
    other = do(write_study(tmp_path, STUDY.replace("seed: 5", "seed: 6")), tmp_path / "c")
    with pytest.raises(NotComparable, match=r"run 0 of .*/a and of .*/c have different seeds"):
        compare_campaigns(pair[0], other)
    wider = do(write_study(tmp_path, STUDY.replace("[-1, 1]", "[-2, 2]")), tmp_path / "d")
    with pytest.raises(NotComparable, match="were drawn differently: world/current/east is"):
        compare_campaigns(pair[0], wider)


def test_mcnemar_is_exact():
    assert mcnemar_p_value(0, 0) == 1.0
    assert mcnemar_p_value(10, 2) == pytest.approx(0.03857421875)
    assert mcnemar_p_value(1, 6) == mcnemar_p_value(6, 1) == 0.125


def test_a_run_again_is_the_same_and_says_if_not(tmp_path):
    data = do(write_study(tmp_path, f"{STUDY}logs: failed\n"), tmp_path / "a")
    failed = next(row["run"] for row in data.counted_rows if not row["passed"])
    again = repeat_run(data, failed, StandInRuns(), log_root=tmp_path / "again", make_draft=StandInDraft)
    assert not again.differences
    assert again.result.hashes["lauv"] == again.row["hashes.lauv"]
    changed = repeat_run(data, failed, Shifted(), make_draft=StandInDraft)
    assert not changed.differences  # the stand-in has the fingerprint of what was not changed
    what_if = repeat_run(data, failed, StandInRuns(), changes={"world/current/north": 0.0}, make_draft=StandInDraft)
    assert what_if.result.metrics["drift"] < again.result.metrics["drift"]
    assert not what_if.differences
    other = replace(again.result, fingerprint="f" * 64, hashes={"lauv": "0" * 64})
    words = repeat_run(data, failed, lambda _: other, make_draft=StandInDraft).differences
    assert words[0].startswith("fingerprint ffffffffffffffff, was ")
    assert words[1].startswith("log of lauv has hash 0000000000000000, was ")


def test_a_run_of_a_study_that_has_changed_is_not_done_again(tmp_path):
    path = write_study(tmp_path)
    do(path, tmp_path / "a")
    data = open_results(tmp_path / "a")
    assert reload_study(data, make_draft=StandInDraft).file == path
    with pytest.raises(ResultsError, match="has no run 40; it has runs 0 to 39"):
        repeat_run(data, 40, StandInRuns(), make_draft=StandInDraft)
    write_study(tmp_path, STUDY.replace("0.5", "0.6"))
    with pytest.raises(ResultsError, match=r"dive\.study\.yaml, or a file that it names, has changed since"):
        repeat_run(data, 3, StandInRuns(), make_draft=StandInDraft)
    path.unlink()
    with pytest.raises(ResultsError, match="which is not there; --study FILE gives its place"):
        repeat_run(data, 3, StandInRuns(), make_draft=StandInDraft)
    assert math.isnan(data.rows[0]["metrics.never"])


class Cut(StandInRuns):
    """Every fourth run is ended from outside."""

    def __call__(self, job):
        return (
            super().__call__(job)
            if int(job.key) % 4
            else job.failed_result("not done after 9 s of wall time", UnfinishedResult)
        )


def test_runs_that_did_not_end_are_left_out_and_reported(tmp_path):
    study = write_study(tmp_path)
    whole, cut = do(study, tmp_path / "a"), do(study, tmp_path / "b", Cut)
    found = compare_campaigns(whole, cut)
    assert (found.unfinished, found.only_a, found.only_b) == (10, 0, 0)
    assert found.rate_a.runs == found.rate_b.runs == 30
    assert not found.broken
    done = shoal("campaign", "compare", str(tmp_path / "a"), str(tmp_path / "b"))
    assert "not compared: 10 runs that did not end in both\n" in done.output


def test_a_search_has_no_pairs(pair):
    search = replace(pair[1], metadata={**pair[1].metadata, "search": {}})
    with pytest.raises(NotComparable, match="b is of a search: its runs went where the search led them"):
        compare_campaigns(pair[0], search)
