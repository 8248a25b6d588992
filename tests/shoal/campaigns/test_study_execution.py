"""Campaigns: whatever ends one, nothing is done or counted twice; and what they tell does not depend on workers."""

import errno
import json
import math
import os
import signal
import subprocess
import sys
import zlib
from dataclasses import replace
from functools import partial
from pathlib import Path

import pyarrow.parquet
import pytest

from shoal.campaigns.jobs.job import UnfinishedResult
from shoal.campaigns.pass_rate import PassRate, StoppingRule
from shoal.campaigns.report.html_page import campaign_html
from shoal.campaigns.results import append_log as journal_module
from shoal.campaigns.results.append_log import AppendLog, AppendLogInUse, read_append_log
from shoal.campaigns.results.store import ResultsError, open_results
from shoal.campaigns.studies.study import load_study
from shoal.campaigns.study_execution import run_study
from tests.outside import NO_SPACE, until
from tests.shoal.campaigns.standin import STUDY, StandInDraft, StandInRuns, comparable, write_study

ROOT = Path(__file__).parents[3]


def do(study, folder, workers=0, make=StandInRuns, **options):
    return run_study(load_study(study, make_draft=StandInDraft), folder, make_runner=make, workers=workers, **options)


def test_a_row_has_all_of_a_run(tmp_path):
    data = do(write_study(tmp_path), tmp_path / "runs")
    assert [row["run"] for row in data.counted_rows] == list(range(40))
    frame = data.data_frame()
    row = frame.loc[7]
    assert row["metrics.drift"] == pytest.approx(0.8 - row["margins.stays_near"])
    assert row["margin"] == row["margins.stays_near"]
    assert row["margins.ends_well"] == math.inf
    assert row["outcomes.lauv"] == "SUCCESS"
    assert row["seconds"] == 600.0
    assert len(row["fingerprint"]) == 64
    assert "numpy" in row["versions"]
    assert frame["passed"].sum() == data.pass_rate.passed == (frame["metrics.drift"] < 0.8).sum()
    failed = frame[~frame["passed"]].iloc[0]
    assert failed["reason"].startswith("stays_near: drift of ")
    table = pyarrow.parquet.read_table(tmp_path / "runs" / "runs.parquet")
    assert table.to_pandas().set_index("run").equals(frame)
    assert json.loads(table.schema.metadata[b"varied"])["world/current/east"] == "uniform: [-1, 1]"


@pytest.mark.heavy
def test_results_are_equal_for_any_number_of_workers(tmp_path):
    study = write_study(tmp_path, STUDY.replace("runs: 40", "until: {pass rate known to: 12 %}"))
    one, two = do(study, tmp_path / "one"), do(study, tmp_path / "two", workers=2)
    assert one.end == two.end
    assert 60 < one.end < 260
    assert comparable(one) == comparable(two)
    assert one.pass_rate.width <= 0.12


def test_it_ends_when_the_rate_is_known_and_no_run_later_counts():
    ending = StoppingRule(1000, 0.01)
    passed = next(n for n in range(1, 1000) if ending.is_reached(n, n))
    assert passed == 381  # z² / (n + z²) <= 1 %
    assert PassRate(381, 381).width <= 0.01
    assert StoppingRule(30, 0.01).is_reached(15, 30)
    assert StoppingRule(30, 0.01).is_reached(5, 10, unknown=20)
    assert not StoppingRule(1000, 0.01).is_reached(0, 0, unknown=500)


class CutShort(StandInRuns):
    """Every fourth run is ended from outside."""

    def __call__(self, job):
        cut = int(job.key) % 4 == 1
        return job.failed_result("the run took longer than 1 s", UnfinishedResult) if cut else super().__call__(job)


@pytest.mark.heavy
def test_runs_whose_outcome_is_unknown_are_no_failures(tmp_path):
    study = write_study(tmp_path, STUDY.replace("runs: 40", "until: {pass rate known to: 12 %, at most: 400}"))
    data = do(study, tmp_path / "runs", make=CutShort)
    rows = data.counted_rows
    cut = [row["run"] for row in rows if row["run"] % 4 == 1]
    rate = data.pass_rate
    assert (rate.runs, rate.unknown) == (len(rows) - len(cut), len(cut))
    assert rate.passed == len([row for row in rows if row["passed"]])
    before = [row for row in rows[:-1] if row["finished"]]
    passed = len([row for row in before if row["passed"]])
    assert rate.width <= 0.12 < PassRate(passed, len(before)).width
    assert str(rate).endswith(f"; the outcome of {len(cut)} more is unknown")
    page = campaign_html(data, data.folder)
    assert f"<b>{len(cut)}</b><span>more did not end: outcome unknown" in page
    assert f"<b>{rate.passed} of {rate.runs}</b>" in page
    none = replace(rate, passed=0, runs=0)
    assert str(none) == f"no run yet; the outcome of {len(cut)} more is unknown"


@pytest.mark.parametrize("sampling", ["sobol", "saltelli"])
def test_no_interval_is_shown_where_runs_depend_on_each_other(tmp_path, sampling):
    data = do(write_study(tmp_path, f"{STUDY}sampling: {sampling}\n"), tmp_path / "runs")
    assert all(math.isnan(end) for end in data.pass_rate.interval)
    assert "Wilson" not in str(data.pass_rate)
    assert f"no interval: the runs of sampling {sampling} are not independent" in str(data.pass_rate)
    page = campaign_html(data, data.folder)
    assert "Wilson" not in page
    assert "nan" not in page


@pytest.mark.parametrize(
    ("passed", "runs", "low", "high"),
    [(0, 10, 0.0, 0.2775), (10, 10, 0.7225, 1.0), (5, 10, 0.2366, 0.7634), (81, 263, 0.2553, 0.3662)],
)
def test_the_interval_is_that_of_wilson(passed, runs, low, high):
    """The last case is that of Newcombe 1998, table I."""
    assert PassRate(passed, runs).interval == pytest.approx((low, high), abs=5e-5)


def test_a_run_that_ends_with_an_exception_is_a_row(tmp_path):
    data = do(write_study(tmp_path), tmp_path / "runs", make=partial(StandInRuns, deadly=3))
    assert data.rows[3]["error"] == "Navigation.AUV: ZeroDivisionError"
    assert not data.rows[3]["passed"]
    assert data.pass_rate.runs == 40
    assert math.isnan(data.data_frame().loc[3, "metrics.drift"])


SCRIPT = """
import sys, time
from dataclasses import replace
from functools import partial
from pathlib import Path
from shoal.campaigns.study_execution import run_study
from shoal.campaigns import load_study
from tests.shoal.campaigns.standin import StandInDraft, StandInRuns
def slow(data):
    print(len(data.rows), flush=True)
    time.sleep(0.005)
folder = Path(sys.argv[1])
study = load_study(folder / "dive.study.yaml", make_draft=StandInDraft)
run_study(study, folder / "runs", make_runner=partial(StandInRuns, folder / "count"), workers=0, on_progress=slow)
"""


@pytest.mark.heavy
def test_killed_at_any_moment_it_goes_on_and_does_nothing_twice(tmp_path):
    write_study(tmp_path, STUDY.replace("runs: 40", "runs: 80"))
    command = [sys.executable, "-c", SCRIPT, str(tmp_path)]
    for done in (3, 40, 41):
        with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
            while int(process.stdout.readline()) < done:
                pass
            process.send_signal(signal.SIGKILL)
            process.communicate()
        assert len(open_results(tmp_path / "runs").rows) >= done
    subprocess.run(command, cwd=ROOT, stdout=subprocess.DEVNULL, check=True)
    whole = do(tmp_path / "dive.study.yaml", tmp_path / "at once")
    assert comparable(open_results(tmp_path / "runs")) == comparable(whole)
    counted = (tmp_path / "count").read_text().split()
    assert set(map(int, counted)) == set(range(80))
    assert len(counted) <= 80 + 3  # at most the run in which it was killed
    assert not list((tmp_path / "runs").glob(".runs*"))


def test_a_line_that_is_not_whole_or_damaged_is_done_again(tmp_path):
    study, folder = write_study(tmp_path), tmp_path / "runs"
    whole = do(study, folder)
    path = folder / "runs.journal"
    lines = path.read_bytes().splitlines(keepends=True)
    lines[5] = lines[5].replace(b"SUCCESS", b"FAILURE")
    path.write_bytes(b"".join(lines[:30]) + lines[30][:20])
    count = tmp_path / "count"
    again = do(study, folder, make=partial(StandInRuns, count))
    assert again.damaged_lines == 1
    assert sorted(map(int, count.read_text().split())) == [4, *range(29, 40)]
    assert comparable(again) == comparable(whole)


def test_more_runs_are_added_and_fewer_leave_the_rest_uncounted(tmp_path):
    folder, count = tmp_path / "runs", tmp_path / "count"
    do(write_study(tmp_path), folder)
    more = do(write_study(tmp_path, STUDY.replace("40", "50")), folder, make=partial(StandInRuns, count))
    assert more.pass_rate.runs == 50
    assert sorted(map(int, count.read_text().split())) == list(range(40, 50))
    assert do(write_study(tmp_path, STUDY.replace("40", "20")), folder).pass_rate.runs == 20


def test_a_folder_of_another_study_is_refused(tmp_path):
    study, folder = write_study(tmp_path), tmp_path / "runs"
    do(study, folder)
    had = (folder / "runs.journal").read_bytes()
    with pytest.raises(ResultsError, match=r"'dive': seed \(5, not 6\) differs; name another folder with -o"):
        do(write_study(tmp_path, STUDY.replace("seed: 5", "seed: 6")), folder)
    both = STUDY.replace("seed: 5", "seed: 6").replace("[-1, 1]", "[-2, 1]")
    with pytest.raises(ResultsError, match=r"seed \(5, not 6\) and what varies \(world/current/east\) differ;"):
        do(write_study(tmp_path, both), folder)
    with pytest.raises(ResultsError, match="the scenario or one of its files has changed"):
        do(write_study(tmp_path, scenario="scenario: dive\nworld: {current: {north: 0, east: 1}}\n"), folder)
    assert (folder / "runs.journal").read_bytes() == had
    with pytest.raises(ResultsError, match="is not the data set of a campaign"):
        open_results(tmp_path)


def test_a_folder_of_another_version_is_refused(tmp_path, monkeypatch):
    study, folder = write_study(tmp_path), tmp_path / "runs"
    do(study, folder)
    monkeypatch.setattr("shoal.campaigns.results.store.software_versions", lambda: "shoal 9")
    with pytest.raises(
        ResultsError,
        match=r"another version: they were made with shoal .*, others with shoal 9; name",
    ):
        do(study, folder)


def test_two_processes_cannot_write_one_data_set(tmp_path):
    with AppendLog(tmp_path / "j") as first:
        first.append({"run": 1})
        with pytest.raises(AppendLogInUse, match="another process is at work"):
            AppendLog(tmp_path / "j")
    assert read_append_log(tmp_path / "j") == ([{"run": 1}], 0)


def test_a_full_disk_is_an_error_and_what_was_done_stays(tmp_path, monkeypatch):
    study, folder = write_study(tmp_path), tmp_path / "runs"
    real, room = os.write, [6000]

    def write(file, data):
        part = data[: max(room[0], 0)]
        room[0] -= len(part)
        if not part:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return real(file, part)

    monkeypatch.setattr(journal_module.os, "write", write)
    with pytest.raises(OSError, match=rf"{NO_SPACE}: .*runs\.journal"):
        do(study, folder)
    monkeypatch.undo()
    had = open_results(folder)
    assert 3 < len(had.rows) < 40
    assert had.damaged_lines == 0
    for line in (folder / "runs.journal").read_bytes().splitlines():
        assert int(line[:8], 16) == zlib.crc32(line[9:])
    assert do(study, folder).pass_rate.runs == 40


class Cramped(StandInRuns):
    """The disk has no room for the log of run 5."""

    def __call__(self, job):
        result = super().__call__(job)
        if job.key != 5 or job.log_root is None:
            return result
        words = f"the log of lauv is not complete: {os.strerror(errno.ENOSPC)}"
        return replace(result, warnings=(words,), hashes={})


def test_a_run_whose_log_has_no_room_is_done_again(tmp_path):
    study, folder = write_study(tmp_path, STUDY + "logs: all\n"), tmp_path / "runs"
    with pytest.raises(OSError, match=rf"{NO_SPACE}: .*000005"):
        do(study, folder, make=Cramped)
    assert sorted(open_results(folder).rows) == list(range(5))
    data = do(study, folder)
    assert data.pass_rate.runs == 40
    assert all("hashes.lauv" in row for row in data.counted_rows)


@pytest.mark.heavy
def test_logs_are_kept_of_all_of_the_failed_or_of_none(tmp_path):
    kept = {}
    for logs in ("all", "failed", "none"):
        folder = tmp_path / logs
        data = do(write_study(tmp_path, f"{STUDY}logs: {logs}\n"), folder, workers=2 if logs == "failed" else 0)
        kept[logs] = {int(path.name) for path in (folder / "logs").glob("*")}
        for row in data.counted_rows:
            assert ("logs.lauv" in row) == ("hashes.lauv" in row) == (row["run"] in kept[logs])
            assert not row.get("logs.lauv") or (folder / row["logs.lauv"] / "Data.lsf").is_file()
    assert kept["all"] == set(range(40))
    assert kept["failed"] == {row["run"] for row in data.counted_rows if not row["passed"]}
    assert 0 < len(kept["failed"]) < 20
    assert not kept["none"]


def test_an_interrupt_leaves_a_table(tmp_path):
    def interrupt(data):
        if len(data.rows) == 12:
            raise KeyboardInterrupt

    folder = tmp_path / "runs"
    with pytest.raises(KeyboardInterrupt):
        do(write_study(tmp_path), folder, on_progress=interrupt)
    assert until(lambda: pyarrow.parquet.read_table(folder / "runs.parquet").num_rows == 12)


def test_a_text_that_is_not_utf_8_is_kept(tmp_path):
    record = {"error": "Bad \udcff text", "margin": math.inf, "run": 3}
    with AppendLog(tmp_path / "j") as journal:
        journal.append(record)
    assert read_append_log(tmp_path / "j") == ([record], 0)
