"""A campaign in parts: together they are the campaign; what is missing, doubled, strange or not ended is told."""

import math
import shutil
from functools import partial
from pathlib import Path

import pyarrow.parquet
import pytest

from shoal.campaigns import (
    Shard,
    UnfinishedResult,
    compare_campaigns,
    merge_results,
    open_results,
    parse_shard,
    repeat_run,
    shard_folder,
)
from shoal.campaigns.report.html_page import campaign_html
from shoal.campaigns.results.store import ResultsError
from shoal.campaigns.studies.study import load_study
from shoal.campaigns.study_execution import run_study
from tests.shoal.campaigns.standin import STUDY, StandInDraft, StandInRuns, write_study


def do(study, folder, shard="1/1", make=StandInRuns, **options):
    part = parse_shard(shard)
    plan = load_study(study, make_draft=StandInDraft, **options)
    return run_study(plan, shard_folder(folder, part), make_runner=make, workers=0, shard=part)


def columns(folder):
    """The columns of a Parquet file with what decides their bytes: type and content, apart from CPU times."""
    table = pyarrow.parquet.read_table(folder / "runs.parquet")
    return {name: (table.schema.field(name).type, repr(table[name].to_pylist())) for name in table.column_names
            if name != "cpu"}  # fmt: skip


class Hangs(StandInRuns):
    """Does not end the runs whose numbers are in a file."""

    def __init__(self, file, counter=None):
        super().__init__(counter)
        self._file = file

    def __call__(self, job):
        if str(job.key) in Path(self._file).read_text().split():
            return job.failed_result("not done after 9 s of wall time", UnfinishedResult)
        return super().__call__(job)


@pytest.mark.parametrize("sampling", ["random", "latin hypercube", "sobol"])
def test_merged_shards_are_the_campaign(tmp_path, sampling):
    study = write_study(tmp_path, f"{STUDY}sampling: {sampling}\nlogs: failed\n")
    whole = do(study, tmp_path / "whole")
    for number in (3, 1, 4, 2):
        part = do(study, tmp_path / "parts", f"{number}/4")
        assert [row["run"] for row in part.counted_rows] == list(range(number - 1, 40, 4))
        assert part.end == 40
    made = merge_results(
        [open_results(folder) for folder in sorted((tmp_path / "parts").glob("shard-*"))], tmp_path / "out"
    )
    assert (made.missing, made.unfinished, made.duplicates, made.data.end) == ((), (), 0, 40)
    assert columns(tmp_path / "out") == columns(tmp_path / "whole")
    assert [path.name for path in sorted((tmp_path / "out" / "logs").iterdir())] == [
        f"{row['run']:06d}" for row in whole.counted_rows if not row["passed"]
    ]
    for row in open_results(tmp_path / "out").counted_rows:
        log = row.get("logs.lauv")
        assert (
            log is None
            or (tmp_path / "out" / log / "Data.lsf").read_bytes()
            == (tmp_path / "whole" / log / "Data.lsf").read_bytes()
        )


@pytest.mark.heavy
def test_a_merged_campaign_is_reported_compared_and_run_again(tmp_path):
    study = write_study(tmp_path)
    parts = [do(study, tmp_path, f"{number}/2") for number in (1, 2)]
    made = merge_results(parts, tmp_path / "out").data
    assert "40 of 40" not in campaign_html(made, tmp_path)
    assert f"{made.pass_rate.passed} of 40" in campaign_html(made, tmp_path)
    assert not compare_campaigns(made, do(study, tmp_path / "whole")).only_a
    assert repeat_run(made, 7, StandInRuns(), make_draft=StandInDraft).differences == ()


def test_a_campaign_whose_study_has_moved_is_run_again_from_where_it_is(tmp_path):
    data = do(write_study(tmp_path / "there"), tmp_path / "runs")
    (tmp_path / "there").rename(tmp_path / "here")
    with pytest.raises(ResultsError, match="is not there; --study FILE gives its place"):
        repeat_run(data, 7, StandInRuns(), make_draft=StandInDraft)
    file = tmp_path / "here" / "dive.study.yaml"
    assert repeat_run(data, 7, StandInRuns(), make_draft=StandInDraft, file=file).differences == ()


def test_what_is_missing_is_reported_and_the_campaign_goes_on_with_it(tmp_path):
    study, count = write_study(tmp_path), tmp_path / "count"
    made = merge_results([do(study, tmp_path, "1/4"), do(study, tmp_path, "3/4")], tmp_path / "out")
    assert made.missing == tuple(run for run in range(40) if run % 4 in (1, 3))
    assert (made.most, made.data.end, made.data.pass_rate.runs) == (40, None, 20)
    whole = do(study, tmp_path / "out", make=partial(StandInRuns, count))
    assert sorted(map(int, count.read_text().split())) == list(made.missing)
    assert whole.end == 40
    assert columns(tmp_path / "out").keys() == columns(tmp_path / "shard-1-of-4").keys()


def test_a_late_shard_is_added_and_merging_twice_changes_nothing(tmp_path):
    study = write_study(tmp_path)
    parts = [do(study, tmp_path, f"{number}/3") for number in (1, 2, 3)]
    assert len(merge_results(parts[:2], tmp_path / "out").missing) == 13
    assert merge_results(parts, tmp_path / "out").missing == ()
    had = columns(tmp_path / "out")
    assert merge_results([open_results(tmp_path / "out"), parts[1]], tmp_path / "out").duplicates == 13
    assert columns(tmp_path / "out") == had
    assert open_results(tmp_path / "out").end == 40


def test_a_shard_goes_on_with_more_runs_and_the_largest_number_counts(tmp_path):
    study, count = write_study(tmp_path), tmp_path / "count"
    do(study, tmp_path, "1/2")
    more = do(study, tmp_path, "1/2", make=partial(StandInRuns, count), runs=50)
    assert list(map(int, count.read_text().split())) == list(range(40, 50, 2))
    made = merge_results([more, do(study, tmp_path, "2/2")], tmp_path / "out")
    assert made.missing == tuple(range(41, 50, 2))


def test_runs_done_twice_count_once_and_must_be_the_same(tmp_path):
    study = write_study(tmp_path)
    whole = do(study, tmp_path / "whole")
    part = do(study, tmp_path, "2/8", logs="all")
    made = merge_results([whole, part], tmp_path / "out")
    assert (made.duplicates, made.data.pass_rate.runs) == (5, 40)
    part.rows[9]["metrics.drift"] += 1e-15
    with pytest.raises(ResultsError, match=r"run 9 is not the same in .*whole and in .*shard-2-of-8: metrics.drift"):
        merge_results([whole, part], tmp_path / "other")
    with pytest.raises(ResultsError, match=r"run 9 is not the same in .*out and in .*shard-2-of-8: metrics.drift"):
        merge_results([part], tmp_path / "out")


def test_data_sets_of_other_studies_and_versions_are_refused(tmp_path):
    a = do(write_study(tmp_path), tmp_path, "1/2")
    b = do(write_study(tmp_path, STUDY.replace("seed: 5", "seed: 6")), tmp_path / "b", "2/2")
    with pytest.raises(ResultsError, match=r"has, beside .*, runs of another study, 'dive': seed .* differs"):
        merge_results([a, b], tmp_path / "out")
    assert not (tmp_path / "out").exists()
    other = open_results(a.folder)
    other.metadata["versions"] = "shoal 9"
    with pytest.raises(ResultsError, match=r"runs of another version: they were made with shoal 9, others with shoal "):
        merge_results([a, other], tmp_path / "out")
    merge_results([a], tmp_path / "out")
    with pytest.raises(
        ResultsError, match=r"out has runs of another study, 'dive': seed .* differs; name another folder"
    ):
        merge_results([b], tmp_path / "out")


def test_logs_that_are_not_there_are_not_promised_and_nothing_outside_is_touched(tmp_path):
    part = do(write_study(tmp_path), tmp_path, "1/8", logs="all")
    shutil.rmtree(part.folder / "logs" / "000008")
    part.rows[16]["logs.lauv"] = "logs/.."
    made = merge_results([part], tmp_path / "out").data
    assert "logs.lauv" not in made.rows[8]
    assert made.rows[8]["hashes.lauv"] == part.rows[8]["hashes.lauv"]
    assert {path.name for path in (tmp_path / "out" / "logs").iterdir()} == {"000000", "000016", "000024", "000032"}


def test_runs_that_did_not_end_are_done_again(tmp_path):
    study, hung, count = write_study(tmp_path), tmp_path / "hung", tmp_path / "count"
    hung.write_text("3 17")
    first = do(study, tmp_path / "runs", make=partial(Hangs, hung))
    assert [row["run"] for row in first.counted_rows if not row["finished"]] == [3, 17]
    assert first.rows[3]["error"].startswith("not done after 9 s")
    hung.write_text("17")
    again = do(study, tmp_path / "runs", make=partial(Hangs, hung, count))
    assert count.read_text().split() == ["3"]
    assert (again.pass_rate.runs, again.pass_rate.unknown) == (39, 1)
    assert [row["run"] for row in open_results(tmp_path / "runs").counted_rows if not row["finished"]] == [17]
    hung.write_text("")
    do(study, tmp_path / "runs", make=partial(Hangs, hung))
    do(study, tmp_path / "whole")
    assert columns(tmp_path / "runs") == columns(tmp_path / "whole")


def test_a_run_that_did_not_end_gives_way_to_one_that_did(tmp_path):
    study, hung = write_study(tmp_path), tmp_path / "hung"
    hung.write_text("3 17")
    bad = do(study, tmp_path / "bad", make=partial(Hangs, hung))
    made = merge_results([bad], tmp_path / "out")
    assert (made.unfinished, made.missing) == ((3, 17), ())
    good = do(study, tmp_path, "4/8")
    assert merge_results([bad, good], tmp_path / "out").unfinished == (17,)
    assert math.isfinite(open_results(tmp_path / "out").rows[3]["margin"])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("0/16", "is not a shard such as 3/16, the third of sixteen; the first is 1"),
        ("17/16", "is not a shard such as 3/16"),
        ("3", "is not a shard such as 3/16"),
        ("-1/4", "is not a shard such as 3/16"),
        ("1/0", "is not a shard such as 3/16"),
        ("1/999999", "is not a shard such as 3/16"),
        ("a/b", "'a/b' is not a shard"),
    ],
)
def test_wrong_shards_are_reported(text, said):
    with pytest.raises(ValueError, match=said):
        parse_shard(text)


def test_shards_have_names_that_sort_and_may_have_no_run(tmp_path):
    assert shard_folder(tmp_path, Shard(3, 16)).name == "shard-03-of-16"
    empty = do(write_study(tmp_path), tmp_path, "50/60")
    assert (empty.counted_rows, empty.end) == ([], 40)
    assert pyarrow.parquet.read_table(empty.folder / "runs.parquet").num_rows == 0


def test_a_shard_cannot_tell_when_the_pass_rate_of_all_is_known(tmp_path):
    study = write_study(tmp_path, STUDY.replace("runs: 40", "until: {pass rate known to: 6 %}"))
    with pytest.raises(ValueError, match="shard 1/2 cannot compute the interval of all shards' pass rate; give"):
        do(study, tmp_path, "1/2")
    assert do(study, tmp_path, "1/2", runs=10).pass_rate.runs == 5
