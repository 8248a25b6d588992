"""Carries out a study: does what is not done yet, and keeps what is."""

import errno
import os
import shutil
import time
from collections.abc import Callable, Generator, Iterable, Mapping
from contextlib import ExitStack, suppress
from pathlib import Path

from shoal.campaigns.executor_factory import open_executor
from shoal.campaigns.findings_files import write_findings
from shoal.campaigns.jobs import (
    WALL_LIMIT,
    Job,
    JobExecutor,
    RunJob,
    StudyRunner,
    TimedResult,
    is_finished,
    make_row,
)
from shoal.campaigns.optional_import import import_optional
from shoal.campaigns.provenance import software_versions
from shoal.campaigns.results import LOGS, CampaignResults, ResultsWriter, study_metadata
from shoal.campaigns.sampling import Scalar
from shoal.campaigns.search import SearchSchedule
from shoal.campaigns.shards import WHOLE_CAMPAIGN, Shard, check_shard_stopping
from shoal.campaigns.studies import Study
from shoal.scenarios import ScenarioResult

TABLE_PERIOD = 60.0  # s of wall time between two Parquet files
OnProgress = Callable[[CampaignResults], None]


def run_study(
    study: Study,
    folder: Path,
    *,
    make_runner: Callable[[], RunJob] = StudyRunner,
    workers: int | None = None,
    wall_limit: float = WALL_LIMIT,
    shard: Shard = WHOLE_CAMPAIGN,
    on: str = "",
    on_progress: OnProgress = lambda _: None,
    on_notice: Callable[[str], None] = lambda _: None,
) -> CampaignResults:
    """Do the runs of a study that its folder does not have yet, until there are enough.

    `on_progress` receives each one. After any end the runs done stay, and the next call does the others, and
    repeats those that did not end. Of a `shard` only its runs; a search has no shards. Raises what `ResultsWriter` and
    `open_executor` raise; ValueError if a shard cannot see when it is over; OSError if the disk is full.
    """
    import_optional("pyarrow.parquet")  # before hours of runs, not after them
    check_shard_stopping(shard, study.stopping_rule)
    if study.search is not None:
        import_optional("optuna")
        if shard != WHOLE_CAMPAIGN:
            raise ValueError(f"search: it cannot run as shard {shard}: its trials follow from all those before")
    with ExitStack() as stack:
        writer = stack.enter_context(ResultsWriter(folder, {**study_metadata(study), "wall limit": wall_limit}))
        data = writer.results
        schedule = _make_schedule(study, data, shard)
        on_progress(data)
        try:
            if schedule.total_runs is None:
                executor = open_executor(
                    study, make_runner=make_runner, workers=workers, wall_limit=wall_limit, on=on, on_notice=on_notice
                )
                _run_batches(study, writer, schedule, stack.enter_context(executor), on_progress)
        except BaseException:
            with suppress(OSError):  # the journal has all of it anyway
                data.write_parquet()
            raise
        if schedule.total_runs is None:
            raise RuntimeError("a run has no result")
        writer.mark_complete(schedule.total_runs)
        data.write_parquet()
        if study.search is not None:
            write_findings(study, data)
    return data


def _make_schedule(study: Study, data: CampaignResults, shard: Shard) -> "_RunSchedule | SearchSchedule":
    if study.search is None:
        return _RunSchedule(study, data, shard)
    return SearchSchedule(study.search, study.stopping_rule.max_runs, study.seed, data.rows)


def _run_batches(
    study: Study,
    writer: ResultsWriter,
    schedule: "_RunSchedule | SearchSchedule",
    executor: JobExecutor,
    on_progress: OnProgress,
) -> None:
    folder = writer.results.folder
    written = time.monotonic()
    for runs in schedule.batches():
        jobs = (_make_job(study, folder, run, schedule.raw_values(run)) for run in runs)
        for job, result in executor.run(jobs):
            run, cpu = int(job.key), result.cpu if isinstance(result, TimedResult) else 0.0
            raw_values = schedule.raw_values(run)
            _check_disk(job, result)
            row = make_row(
                run, study.run_seed(run), raw_values, result, versions=software_versions(), cpu=cpu, folder=folder
            )
            writer.add_row({**row, **schedule.extra_columns(run)})
            schedule.update_total_runs()
            on_progress(writer.results)
            if time.monotonic() - written > TABLE_PERIOD:
                writer.results.write_parquet()
                written = time.monotonic()


def _check_disk(job: Job, result: ScenarioResult) -> None:
    """Raise OSError if the log of a run did not fit on the disk: the run is to be done again when there is room."""
    for code in (errno.ENOSPC, errno.EDQUOT):
        if job.log_root is not None and any(os.strerror(code) in words for words in (result.error, *result.warnings)):
            raise OSError(code, os.strerror(code), str(job.log_root))


def _make_job(study: Study, folder: Path, run: int, raw_values: Mapping[str, Scalar]) -> Job:
    logs = None if study.logs == "none" else run_log_folder(folder, run)
    if logs is not None and logs.exists():  # of a run that was not ended
        shutil.rmtree(logs)
    return Job(run, study.scenario_path, study.with_units(raw_values), study.run_seed(run), logs)


class _RunSchedule:
    """Remaining runs. Whether there are enough is judged on runs 0 to N, in this order, not as they come in:
    the answer is the same for any number of workers."""

    def __init__(self, study: Study, data: CampaignResults, shard: Shard):
        self._study, self._data = study, data
        self._runs = shard.runs(study.stopping_rule.max_runs)
        self._evaluated = self._passed = self._unknown = 0
        self.total_runs: int | None = None
        self.update_total_runs()

    def update_total_runs(self) -> None:
        """Judge the runs that have come in."""
        rows = self._data.rows
        while self.total_runs is None:
            if self._evaluated == len(self._runs):
                self.total_runs = self._study.stopping_rule.max_runs
            elif (run := self._runs[self._evaluated]) in rows:
                is_known = is_finished(rows[run])
                self._passed += is_known and bool(rows[run]["passed"])
                self._unknown += not is_known
                self._evaluated += 1
                known = self._evaluated - self._unknown
                if self._study.stopping_rule.is_reached(self._passed, known, self._unknown):
                    self.total_runs = run + 1
            else:
                break

    def raw_values(self, run: int) -> Mapping[str, Scalar]:
        """Values that a run has drawn, without units."""
        return self._study.design.raw_values(run)

    def extra_columns(self, run: int) -> dict[str, object]:
        """Further columns of the row of a run."""
        return {}

    def batches(self) -> Generator[Iterable[int]]:
        """The runs that are left, all in one round: none depends on others."""
        yield self._left()

    def _left(self) -> Generator[int]:
        for run in self._runs:
            if self.total_runs is not None:
                return
            if run not in self._data.rows:
                yield run


def run_log_folder(folder: Path, run: int) -> Path:
    """Folder of the logs of a run."""
    return (folder / LOGS / f"{run:06d}").absolute()
