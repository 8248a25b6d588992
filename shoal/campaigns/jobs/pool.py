"""Does jobs in processes of this computer; one that dies or hangs loses nothing."""

import os
import tempfile
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import ExitStack
from multiprocessing.connection import wait
from pathlib import Path
from types import TracebackType

from shoal.campaigns.jobs.job import Do, Job, Unfinished
from shoal.campaigns.jobs.runner import Runner
from shoal.campaigns.jobs.worker import Worker, attempt
from shoal.scenarios import ScenarioResult

WALL_LIMIT = 600.0  # s
TRIES = 2  # processes that may die of one job
KILLS = 5  # if the last one was killed, which may come from outside: a scheduler, or the system for want of memory
STILLBORN = 3  # processes, one after another, that ended before they could work


class Pool:
    """Processes that do jobs, and are kept for more of them until the pool is closed.

    `workers` is how many, by default one on each processor; with 0 this process does the jobs itself, without a limit
    of time. Temporary files are in `folder`, by default one of its own, all of which the last process removes if this
    one is killed. A job that takes more than `wall_limit` (s of wall time), or of which two processes die, or five are
    killed, has a Result with an `error`. `code` are folders with tasks of a user. `make` makes in each process what
    does the jobs there.
    """

    def __init__(
        self,
        workers: int | None = None,
        *,
        make: Callable[[], Do] = Runner,
        wall_limit: float = WALL_LIMIT,
        code: Sequence[Path] = (),
        folder: Path | None = None,
    ):
        self._count = processors() if workers is None else workers
        self._make, self._code, self._wall_limit = make, tuple(code), wall_limit
        self._workers: list[Worker] = []
        self._stillborn = 0
        self._again = deque[tuple[Job, int]]()
        self._stack = ExitStack()
        self._folder = folder or Path(
            self._stack.enter_context(tempfile.TemporaryDirectory(prefix="shoal-", ignore_cleanup_errors=True))
        )
        self._here: Do | None = None

    def __enter__(self) -> "Pool":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """End all processes at once."""
        for worker in self._workers:
            worker.end()
        self._workers.clear()
        self._stack.close()

    def run(self, jobs: Iterable[Job]) -> Generator[tuple[Job, ScenarioResult]]:
        """The jobs with their results, in the order of completion. Jobs are asked for when there is somebody for them.

        Raises OSError if no process can be started.
        """
        if self._count == 0:
            self._here = self._here or self._make()
            yield from ((job, attempt(self._here, job)) for job in jobs)
            return
        coming = iter(jobs)
        try:
            while self._hand_out(coming):
                yield from self._listen()
        finally:  # the caller may have heard enough
            self._again.clear()
            for worker in [worker for worker in self._workers if worker.job is not None]:
                self._end(worker)

    def _hand_out(self, coming: Iterator[Job]) -> bool:
        """Give jobs to all that have none; False if there is no job left, and nobody has one."""
        while (idle := next((worker for worker in self._workers if worker.job is None), None)) is not None or (
            len(self._workers) < self._count
        ):
            job, deaths = self._again.popleft() if self._again else (next(coming, None), 0)
            if job is None:
                break
            if idle is None:
                idle = Worker(self._make, self._code, self._folder, self._wall_limit)
                self._workers.append(idle)
            idle.give(job, deaths)
        return any(worker.job is not None for worker in self._workers)

    def _listen(self) -> Iterator[tuple[Job, ScenarioResult]]:
        """What comes next: results, deaths, or limits that are reached."""
        pipes = {worker.pipe: worker for worker in self._workers}
        left = min(worker.seconds_left for worker in self._workers)
        heard = wait(list(pipes), left if left < float("inf") else None)
        for worker in [worker for pipe, worker in pipes.items() if pipe in heard]:
            job = worker.job
            try:
                result = worker.take()
            except EOFError:
                result = self._mourn(worker)
            else:
                self._stillborn = 0
            if job is not None and result is not None:
                yield job, result
        for worker in [worker for worker in self._workers if not worker.seconds_left]:
            job, place = worker.job, worker.where()
            self._end(worker)
            words = f"not done after {self._wall_limit:g} s of wall time"
            if job is not None:
                yield job, job.failed(f"{words}: in {place}" if place else words, Unfinished)

    def _mourn(self, worker: Worker) -> ScenarioResult | None:
        """Bury a worker; another one takes its job, unless too many have died of it."""
        job, deaths, how = worker.job, worker.deaths, self._end(worker)
        if not worker.is_ready:
            self._stillborn += 1
            if self._stillborn >= STILLBORN:
                raise OSError(f"processes end before they can work: {how}")
        elif job is not None and worker.has_begun:  # else it had died before
            deaths += 1
            if deaths >= (KILLS if how == "SIGKILL" else TRIES):
                return job.failed(f"{deaths} processes that ran it ended ({how})", Unfinished)
        if job is not None:
            self._again.append((job, deaths))
        return None

    def _end(self, worker: Worker) -> str:
        self._workers.remove(worker)
        return worker.end()


def processors() -> int:
    """How many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
