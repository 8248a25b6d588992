"""Campaigns on a real Dask cluster: the same rows and logs as here, whoever dies."""

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import pytest

from shoal.campaigns import Job, load_study, open_executor, open_results, run_study
from shoal.campaigns.cluster import dask_executor as cluster_module
from shoal.campaigns.results.append_log import read_append_log
from tests.outside import until
from tests.repeats import repeat
from tests.shoal.campaigns.cluster.grid import ROOT, Grid, descendants, job_processes
from tests.shoal.campaigns.examples import TROUBLE
from tests.shoal.campaigns.standin import comparable
from tests.shoal.campaigns.studies.test_bundle import STUDY, name_absolutely, write

pytestmark = pytest.mark.heavy
DIVES = STUDY.replace("runs: 4", "runs: 12")


@pytest.fixture(scope="module")
def grid(tmp_path_factory):
    """Two workers, which several tests use."""
    grid = Grid(tmp_path_factory.mktemp("grid"))
    try:
        grid.keeper = grid.worker("two", count=2)
        yield grid
    finally:
        grid.close()


@pytest.fixture
def own(tmp_path):
    """A scheduler of a test's own."""
    grid = Grid(tmp_path / "own")
    try:
        yield grid
    finally:
        grid.close()


@pytest.fixture
def study(tmp_path, monkeypatch):
    folder = tmp_path / "study"
    folder.mkdir()
    path = write(folder)
    path.write_text(DIVES)
    monkeypatch.chdir(folder)
    monkeypatch.setattr(sys, "path", [*sys.path, str(folder)])
    for name in [name for name in sys.modules if name.split(".")[0] in ("whistle", "tones", "trouble")]:
        monkeypatch.delitem(sys.modules, name)
    return Path(path.name)


def times_told(folder):
    """How often each run is in the journal."""
    return Counter(record["run"] for record in read_append_log(folder / "runs.journal")[0] if "fingerprint" in record)


def logs_of(folder):
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_rows_and_logs_are_those_of_this_computer(grid, study, tmp_path):
    plan = load_study(study, logs="all", runs=6)
    here = run_study(plan, tmp_path / "here", workers=1)
    there = run_study(plan, tmp_path / "there", on=grid.address)
    assert comparable(there) == comparable(here)
    assert len(there.counted_rows) == 6
    assert not any(row["error"] for row in there.counted_rows)
    assert logs_of(tmp_path / "there" / "logs") == logs_of(tmp_path / "here" / "logs")
    until(lambda: not job_processes(grid.keeper.pid), 60.0)
    assert not list(grid.folder.rglob("shoal-*"))


@pytest.mark.parametrize("absolute", [False, repeat(True)])
def test_content_travels_and_not_the_files(grid, study, tmp_path, absolute):
    if absolute:
        name_absolutely(study.absolute())
    plan = load_study(study, runs=4, logs="all")
    here = run_study(plan, tmp_path / "here", workers=1)
    assert comparable(run_study(plan, tmp_path / "live", workers=0)) == comparable(here)
    for pattern in ("*.py", "*.ini", "*.yaml"):
        for file in study.parent.rglob(pattern):
            file.unlink()
    assert comparable(run_study(plan, tmp_path / "there", on=grid.address)) == comparable(here)


def test_a_search_has_the_same_trials(grid, study, tmp_path):
    study.write_text(DIVES.replace("runs: 12", "runs: 6\nsearch: {maximize: metrics.pitch}"))
    here = run_study(load_study(study), tmp_path / "here", workers=1)
    there = run_study(load_study(study), tmp_path / "there", on=grid.address)
    assert comparable(there) == comparable(here)
    assert len(there.counted_rows) == 6
    assert not any(row["error"] for row in there.counted_rows)


def test_a_worker_that_dies_costs_no_run_and_doubles_none(own, study, tmp_path):
    first, _ = own.worker("first"), own.worker("second")
    victims = [first]

    def tell(data):
        if len(data.rows) == 3 and victims:
            own.kill(victims.pop())

    plan = load_study(study)
    there = run_study(plan, tmp_path / "there", on=own.address, on_progress=tell)
    assert not victims
    assert times_told(tmp_path / "there") == Counter(range(12))
    assert comparable(there) == comparable(run_study(plan, tmp_path / "here", workers=1))


def test_processes_that_are_killed_on_the_cluster_are_replaced(own, study, tmp_path):
    """First the one that Dask's worker has for the runs, then Dask's worker itself, which its nanny starts again."""
    keeper = own.worker("kept")
    killed = []

    def tell(data):
        if len(data.rows) in (2, 5) and len(killed) < len(data.rows) / 2 - 0.5:
            (job_process,) = job_processes(keeper.pid)
            above = next(pid for pid in descendants(keeper.pid) if job_processes(pid))
            killed.append(job_process if len(data.rows) == 2 else above)
            os.kill(killed[-1], signal.SIGKILL)

    there = run_study(load_study(study, runs=8), tmp_path / "there", on=own.address, on_progress=tell)
    assert len(set(killed)) == 2
    assert until(lambda: not any(Path(f"/proc/{pid}").exists() for pid in killed))
    assert times_told(tmp_path / "there") == Counter(range(8))
    assert not any(row["error"] for row in there.counted_rows)


def test_a_worker_that_is_not_the_same_is_refused_by_name_and_others_go_on(own, study, tmp_path):
    own.worker("good")
    own.bare_worker("bare")
    own.worker("otherwise", NPY_DISABLE_CPU_FEATURES="AVX512_SKX X86_V4 AVX2 X86_V3 FMA3")
    notes = []
    there = run_study(load_study(study, runs=4), tmp_path / "there", on=own.address, on_notice=notes.append)
    assert len(there.counted_rows) == 4
    assert any(note.startswith("worker bare (tcp://127.0.0.1:") and "No module named 'shoal'" in note for note in notes)
    others = [note for note in notes if not note.startswith("worker bare")]
    assert all(note.startswith("worker otherwise on ") and "round otherwise" in note for note in others)


def test_another_version_is_refused_and_without_others_the_campaign_ends(own, study, tmp_path, monkeypatch):
    own.worker("old")
    monkeypatch.setattr(cluster_module, "software_versions", lambda: "shoal 9, python 4")
    words = (
        r"no worker is left at dask://.* that could do a run: worker old on .* is rejected: it has shoal 0.*, and this"
    )
    with pytest.raises(OSError, match=words):
        run_study(load_study(study, runs=4), tmp_path / "there", on=own.address)


def test_a_cluster_without_workers_is_an_error_after_a_while(own, study, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster_module, "PATIENCE", 1.0)
    with pytest.raises(OSError, match=r"no worker is left at dask://127.0.0.1:\d+ that could do a run: it has none"):
        run_study(load_study(study, runs=4), tmp_path / "there", on=own.address)


def test_a_worker_that_leaves_after_the_last_run_is_no_error(own, study, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster_module, "PATIENCE", 2.0)
    worker = own.worker("last", "--no-nanny")
    plan = load_study(study, runs=2)
    place = plan.scenario_path, plan.scenario_values(0), plan.run_seed(0)
    with open_executor(plan, wall_limit=60.0, on=own.address) as engine:
        done = engine.run([Job(0, *place)])
        assert not next(done)[1].error
        own.kill(worker)
        assert list(done) == []


def test_a_scheduler_that_is_not_there_is_an_error_that_names_it(study, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster_module, "CONNECT", 1.0)
    with pytest.raises(OSError, match=r"no scheduler of Dask answers at dask://127.0.0.1:9: "):
        run_study(load_study(study, runs=4), tmp_path / "there", on="dask://127.0.0.1:9")


def test_a_scheduler_that_goes_away_leaves_what_was_done(own, study, tmp_path):
    own.worker("one")
    command = "from shoal.cli import main; main()"
    words = [study.name, "--on", own.address, "-o", str(tmp_path / "there")]
    with subprocess.Popen(
        [sys.executable, "-c", command, "campaign", *words],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        until(lambda: (tmp_path / "there" / "runs.journal").is_file() and times_told(tmp_path / "there"), 60.0)
        own.kill(own.scheduler)
        began = time.monotonic()
        _, said = process.communicate(timeout=90.0)
    assert process.returncode == 2, said
    assert f"the scheduler at {own.address} has gone away" in said
    assert "Traceback" not in said
    assert time.monotonic() - began < 60.0
    had = open_results(tmp_path / "there").rows
    assert 0 < len(had) < 12
    whole = run_study(load_study(study), tmp_path / "there", workers=1)
    assert times_told(tmp_path / "there") == Counter(range(12))
    assert comparable(whole) == comparable(run_study(load_study(study), tmp_path / "here", workers=1))


def test_a_run_that_hangs_or_kills_its_process_is_a_row(grid, study, tmp_path):
    Path("trouble.py").write_text(TROUBLE)
    text = DIVES.replace("limit: 3 s", "limit: 8 s").replace("Always}}", "Always}, trouble.Trouble: {Enabled: Always}}")
    how = "  vehicle/parameters/trouble.Trouble/How: {grid: [hang, die, fail, act]}\n"
    study.write_text(text.replace("runs: 12", f"{how}runs: 3"))
    data = run_study(load_study(study), tmp_path / "there", on=grid.address, wall_limit=8.0)
    errors = [data.rows[run]["error"] for run in range(3)]
    assert errors[0].startswith("not done after 8 s of wall time: in ")
    assert f"{study.parent.resolve()}/trouble.py:" in errors[0]
    assert errors[1] == "5 processes that ran it ended (SIGKILL)"
    assert "ZeroDivisionError: of a kind" in errors[2]


def test_who_has_heard_enough_leaves_nothing_behind(grid, study, tmp_path):
    def stop(data):
        if len(data.rows) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_study(load_study(study), tmp_path / "there", on=grid.address, on_progress=stop)
    until(lambda: not job_processes(grid.keeper.pid), 60.0)
    assert len(open_results(tmp_path / "there").rows) == 2
