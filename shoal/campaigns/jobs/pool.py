"""Runs jobs in processes of this computer; one that dies or hangs loses nothing."""

import os
import tempfile
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import ExitStack
from multiprocessing.connection import wait
from pathlib import Path
from types import TracebackType

from shoal.campaigns.jobs.job import Job, RunJob, UnfinishedResult
from shoal.campaigns.jobs.runner import ScenarioRunner
from shoal.campaigns.jobs.worker_process import WorkerProcess, run_job_catching_errors
from shoal.scenarios import ScenarioResult

WALL_LIMIT = 600.0  # s
MAX_DEATHS = 2  # processes that may die of one job
MAX_KILLS = 5  # if the last one was killed, perhaps from outside: by a scheduler, or by the system when memory is short
MAX_FAILED_STARTS = 3  # processes, one after another, that ended before they could work


class ProcessPool:
    """Processes that do jobs, and are kept for more of them until the pool is closed.

    `workers` is how many, by default one on each processor; with 0 this process does the jobs itself, without a limit
    of time. Temporary files are in `folder`, by default one of its own, all of which the last process removes if this
    one is killed. A job that takes more than `wall_limit` (s of wall time), or of which two processes die, or five are
    killed, has a result with an `error`. `code` are folders with tasks of a user. `make_runner` makes in each process
    what does the jobs there.
    """

    def __init__(
        self,
        workers: int | None = None,
        *,
        make_runner: Callable[[], RunJob] = ScenarioRunner,
        wall_limit: float = WALL_LIMIT,
        code: Sequence[Path] = (),
        folder: Path | None = None,
    ):
        self._count = usable_cpus() if workers is None else workers
        self._make_runner, self._code, self._wall_limit = make_runner, tuple(code), wall_limit
        self._workers: list[WorkerProcess] = []
        self._failed_starts = 0
        self._retries = deque[tuple[Job, int]]()
        self._stack = ExitStack()
        self._folder = folder or Path(
            self._stack.enter_context(tempfile.TemporaryDirectory(prefix="shoal-", ignore_cleanup_errors=True))
        )
        self._local_runner: RunJob | None = None

    def __enter__(self) -> "ProcessPool":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """End all processes at once."""
        for worker in self._workers:
            worker.kill()
        self._workers.clear()
        self._stack.close()

    def run(self, jobs: Iterable[Job]) -> Generator[tuple[Job, ScenarioResult]]:
        """The jobs with their results, in the order of completion. Jobs are asked for when there is somebody for them.

        Raises OSError if no process can be started.
        """
        if self._count == 0:
            self._local_runner = self._local_runner or self._make_runner()
            yield from ((job, run_job_catching_errors(self._local_runner, job)) for job in jobs)
            return
        coming = iter(jobs)
        try:
            while self._assign_jobs(coming):
                yield from self._wait_for_results()
        finally:  # the caller may stop here
            self._retries.clear()
            for worker in [worker for worker in self._workers if worker.job is not None]:
                self._end(worker)

    def _assign_jobs(self, coming: Iterator[Job]) -> bool:
        """Give jobs to idle workers; False if no job is left or under way."""
        while (idle := next((worker for worker in self._workers if worker.job is None), None)) is not None or (
            len(self._workers) < self._count
        ):
            job, deaths = self._retries.popleft() if self._retries else (next(coming, None), 0)
            if job is None:
                break
            if idle is None:
                idle = WorkerProcess(self._make_runner, self._code, self._folder, self._wall_limit)
                self._workers.append(idle)
            idle.assign(job, deaths)
        return any(worker.job is not None for worker in self._workers)

    def _wait_for_results(self) -> Iterator[tuple[Job, ScenarioResult]]:
        """Wait for the next results, ends of processes, or limits that are reached."""
        pipes = {worker.pipe: worker for worker in self._workers}
        left = min(worker.seconds_left for worker in self._workers)
        ready = wait(list(pipes), left if left < float("inf") else None)
        for worker in [worker for pipe, worker in pipes.items() if pipe in ready]:
            job = worker.job
            try:
                result = worker.receive()
            except EOFError:
                result = self._on_death(worker)
            else:
                self._failed_starts = 0
            if job is not None and result is not None:
                yield job, result
        for worker in [worker for worker in self._workers if not worker.seconds_left]:
            job, place = worker.job, worker.hang_location()
            self._end(worker)
            words = f"not done after {self._wall_limit:g} s of wall time"
            if job is not None:
                yield job, job.failed_result(f"{words}: in {place}" if place else words, UnfinishedResult)

    def _on_death(self, worker: WorkerProcess) -> ScenarioResult | None:
        """Remove a dead worker; another one takes its job, unless too many workers have died in it."""
        job, deaths, how = worker.job, worker.deaths, self._end(worker)
        if not worker.is_ready:
            self._failed_starts += 1
            if self._failed_starts >= MAX_FAILED_STARTS:
                raise OSError(f"processes end before they can work: {how}")
        elif job is not None and worker.has_begun:  # else it had died before
            deaths += 1
            if deaths >= (MAX_KILLS if how == "SIGKILL" else MAX_DEATHS):
                return job.failed_result(f"{deaths} processes that ran it ended ({how})", UnfinishedResult)
        if job is not None:
            self._retries.append((job, deaths))
        return None

    def _end(self, worker: WorkerProcess) -> str:
        self._workers.remove(worker)
        return worker.kill()


def usable_cpus() -> int:
    """Number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
