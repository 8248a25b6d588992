"""Carries out a study: does what is not done yet, and keeps what is."""

import shutil
import time
from collections.abc import Callable, Generator, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

from shoal.campaigns.dataset import LOGS, DataSet, Recording, about_study
from shoal.campaigns.job import Do, Job, Unfinished, Unreadable
from shoal.campaigns.library import library
from shoal.campaigns.pool import WALL_LIMIT, Pool
from shoal.campaigns.rows import row_of
from shoal.campaigns.shards import WHOLE, Shard, check_shard
from shoal.campaigns.study import Study
from shoal.campaigns.study_runner import StudyRunner
from shoal.campaigns.versions import versions
from shoal.scenarios import Result

TABLE_PERIOD = 60.0  # s of wall time between two Parquet files
Tell = Callable[[DataSet], None]


@dataclass(frozen=True)
class Timed(Result):
    """A result with the CPU seconds that its run took."""

    cpu: float = field(default=0.0, compare=False)


@dataclass
class Timing:
    """Does what `do` does, and takes the time. With `only_failed` a run that passes keeps no log: it is run without
    one first, which is faster, and once more if it fails."""

    do: Do
    only_failed: bool

    def __call__(self, job: Job) -> Result:
        started = time.process_time()
        first = replace(job, log_root=None) if self.only_failed else job
        result = self.do(first)
        cpu = time.process_time() - started
        if isinstance(result, Unfinished | Unreadable):
            return result
        if self.only_failed and not result.passed:
            result = self.do(job)
        return Timed(**vars(result), cpu=cpu)


def timing(make: Callable[[], Do], only_failed: bool) -> Timing:
    """Makes in a process what does the jobs there."""
    return Timing(make(), only_failed)


def carry_out(
    study: Study,
    folder: Path,
    *,
    make: Callable[[], Do] = StudyRunner,
    workers: int | None = None,
    wall_limit: float = WALL_LIMIT,
    code: Sequence[Path] = (),
    shard: Shard = WHOLE,
    tell: Tell = lambda _: None,
) -> DataSet:
    """Do the runs of a study that its folder does not have yet, until there are enough; `tell` hears of each one.

    Whatever ends it, the runs done stay, and the next call does the others, and those again that did not end. Of a
    `shard` only its runs. Raises what `Recording` and `Pool` raise; ValueError if a shard cannot know when it is over;
    OSError if the disk is full.
    """
    library("pyarrow.parquet")  # before hours of runs, not after them
    check_shard(shard, study.ending)
    with ExitStack() as stack:
        recording = stack.enter_context(Recording(folder, about_study(study)))
        data = recording.data
        progress = _Progress(study, data, shard)
        tell(data)
        try:
            if progress.end is None:
                do = partial(timing, make, study.logs == "failed")
                pool = stack.enter_context(Pool(workers, make=do, wall_limit=wall_limit, code=code))
                _work_off(study, recording, progress, pool, tell)
        except BaseException:
            with suppress(OSError):  # the journal has all of it anyway
                data.write()
            raise
        if progress.end is None:
            raise RuntimeError("a run has no result")
        recording.finish(progress.end)
        data.write()
    return data


def _work_off(study: Study, recording: Recording, progress: "_Progress", pool: Pool, tell: Tell) -> None:
    folder = recording.data.folder
    written = time.monotonic()
    for job, result in pool.run(progress.jobs(folder)):
        run, cpu = int(job.key), result.cpu if isinstance(result, Timed) else 0.0
        numbers = study.design.numbers(run)
        row = row_of(run, study.seed_of(run), numbers, result, versions=versions(), cpu=cpu, folder=folder)
        recording.add(row)
        progress.look()
        tell(recording.data)
        if time.monotonic() - written > TABLE_PERIOD:
            recording.data.write()
            written = time.monotonic()


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

    def jobs(self, folder: Path) -> Generator[Job]:
        study = self._study
        for run in self._runs:
            if self.end is not None:
                return
            if run in self._data.rows:
                continue
            logs = None if study.logs == "none" else log_folder(folder, run)
            if logs is not None and logs.exists():  # of a run that was not ended
                shutil.rmtree(logs)
            yield Job(run, study.path, study.values(run), study.seed_of(run), logs)


def log_folder(folder: Path, run: int) -> Path:
    """Where the logs of a run are."""
    return (folder / LOGS / f"{run:06d}").absolute()
