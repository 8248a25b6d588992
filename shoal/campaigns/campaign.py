"""Carries out a study: does what is not done yet, and keeps what is."""

import errno
import os
import shutil
import time
from collections.abc import Callable, Generator, Iterable, Mapping
from contextlib import ExitStack, suppress
from pathlib import Path

from shoal.campaigns.dataset import LOGS, DataSet, Recording, about_study
from shoal.campaigns.draws import Scalar
from shoal.campaigns.engines import open_engine
from shoal.campaigns.jobs import WALL_LIMIT, Do, Engine, Job, StudyRunner, Timed, row_of
from shoal.campaigns.keeping import keep_findings
from shoal.campaigns.library import library
from shoal.campaigns.search import Course
from shoal.campaigns.shards import WHOLE, Shard, check_shard
from shoal.campaigns.studies import Study
from shoal.campaigns.versions import versions
from shoal.scenarios import ScenarioResult

TABLE_PERIOD = 60.0  # s of wall time between two Parquet files
Tell = Callable[[DataSet], None]


def carry_out(
    study: Study,
    folder: Path,
    *,
    make: Callable[[], Do] = StudyRunner,
    workers: int | None = None,
    wall_limit: float = WALL_LIMIT,
    shard: Shard = WHOLE,
    on: str = "",
    tell: Tell = lambda _: None,
    note: Callable[[str], None] = lambda _: None,
) -> DataSet:
    """Do the runs of a study that its folder does not have yet, until there are enough; `tell` hears of each one.

    Whatever ends it, the runs done stay, and the next call does the others, and those again that did not end. Of a
    `shard` only its runs; a search has no shards. Raises what `Recording` and `open_engine` raise; ValueError if a
    shard cannot know when it is over; OSError if the disk is full.
    """
    library("pyarrow.parquet")  # before hours of runs, not after them
    check_shard(shard, study.ending)
    if study.search is not None:
        library("optuna")
        if shard != WHOLE:
            raise ValueError(f"search: there is no shard {shard} of it: its trials follow from all those before")
    with ExitStack() as stack:
        recording = stack.enter_context(Recording(folder, {**about_study(study), "wall limit": wall_limit}))
        data = recording.data
        progress = _progress(study, data, shard)
        tell(data)
        try:
            if progress.end is None:
                engine = open_engine(study, make=make, workers=workers, wall_limit=wall_limit, on=on, note=note)
                _work_off(study, recording, progress, stack.enter_context(engine), tell)
        except BaseException:
            with suppress(OSError):  # the journal has all of it anyway
                data.write()
            raise
        if progress.end is None:
            raise RuntimeError("a run has no result")
        recording.finish(progress.end)
        data.write()
        if study.search is not None:
            keep_findings(study, data)
    return data


def _progress(study: Study, data: DataSet, shard: Shard) -> "_Progress | Course":
    if study.search is None:
        return _Progress(study, data, shard)
    return Course(study.search, study.ending.most, study.seed, data.rows)


def _work_off(study: Study, recording: Recording, progress: "_Progress | Course", engine: Engine, tell: Tell) -> None:
    folder = recording.data.folder
    written = time.monotonic()
    for runs in progress.rounds():
        jobs = (_job(study, folder, run, progress.numbers(run)) for run in runs)
        for job, result in engine.run(jobs):
            run, cpu = int(job.key), result.cpu if isinstance(result, Timed) else 0.0
            numbers = progress.numbers(run)
            _check_disk(job, result)
            row = row_of(run, study.seed_of(run), numbers, result, versions=versions(), cpu=cpu, folder=folder)
            recording.add({**row, **progress.marks(run)})
            progress.look()
            tell(recording.data)
            if time.monotonic() - written > TABLE_PERIOD:
                recording.data.write()
                written = time.monotonic()


def _check_disk(job: Job, result: ScenarioResult) -> None:
    """Raise OSError if the log of a run did not fit on the disk: the run is to be done again when there is room."""
    for code in (errno.ENOSPC, errno.EDQUOT):
        if job.log_root is not None and any(os.strerror(code) in words for words in (result.error, *result.warnings)):
            raise OSError(code, os.strerror(code), str(job.log_root))


def _job(study: Study, folder: Path, run: int, numbers: Mapping[str, Scalar]) -> Job:
    logs = None if study.logs == "none" else log_folder(folder, run)
    if logs is not None and logs.exists():  # of a run that was not ended
        shutil.rmtree(logs)
    return Job(run, study.path, study.written(numbers), study.seed_of(run), logs)


class _Progress:
    """Which runs are left. Whether there are enough is judged on runs 0 to N, in this order, not as they come in:
    the answer is the same for any number of workers."""

    def __init__(self, study: Study, data: DataSet, shard: Shard):
        self._study, self._data = study, data
        self._runs = shard.runs(study.ending.most)
        self._judged = self._passed = 0
        self.end: int | None = None
        self.look()

    def look(self) -> None:
        """Judge the runs that have come in."""
        rows = self._data.rows
        while self.end is None:
            if self._judged == len(self._runs):
                self.end = self._study.ending.most
            elif (run := self._runs[self._judged]) in rows:
                self._passed += bool(rows[run]["passed"])
                self._judged += 1
                if self._study.ending.reached(self._passed, self._judged):
                    self.end = run + 1
            else:
                break

    def numbers(self, run: int) -> Mapping[str, Scalar]:
        """What a run has drawn, without units."""
        return self._study.design.numbers(run)

    def marks(self, run: int) -> dict[str, object]:
        """What its row says besides."""
        return {}

    def rounds(self) -> Generator[Iterable[int]]:
        """The runs that are left, all in one round: none depends on others."""
        yield self._left()

    def _left(self) -> Generator[int]:
        for run in self._runs:
            if self.end is not None:
                return
            if run not in self._data.rows:
                yield run


def log_folder(folder: Path, run: int) -> Path:
    """Where the logs of a run are."""
    return (folder / LOGS / f"{run:06d}").absolute()
