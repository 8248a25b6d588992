"""The engine of a campaign whose runs are done by workers of Dask."""

import json
import logging
import pkgutil
import shutil
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any
from uuid import uuid4

from runtime.task import format_exception_line
from shoal.campaigns.cluster import dask_worker
from shoal.campaigns.cluster.address import to_dask_address
from shoal.campaigns.cluster.float_fingerprint import compute_float_fingerprint
from shoal.campaigns.cluster.protocol import JsonLine, encode_line, job_to_line, result_from_line
from shoal.campaigns.jobs import Job, UnfinishedResult
from shoal.campaigns.optional_import import import_optional
from shoal.campaigns.provenance import software_versions
from shoal.campaigns.studies import Study
from shoal.scenarios import ScenarioResult

CONNECT = 10.0  # s until the scheduler must have answered
POLL_PERIOD = 1.0  # s between two looks at who is there
PATIENCE = 30.0  # s without any worker that may do jobs: one may just start again
DEATHS = 5  # workers that may be lost, one after another, with the same job
FETCH = 5.0  # s for a result to arrive, until it is asked whether its worker is still there
LEAVE = 5.0  # s


@dataclass
class _AssignedJob:
    """A job that was given to a worker. `deaths` is how many have been lost with it before."""

    job: Job
    worker_address: str
    deaths: int
    future: Any


@dataclass
class _DaskWorker:
    """A worker that may do jobs, as many at a time as it has threads."""

    name: str
    threads: int
    assigned: set[str] = field(default_factory=set[str])


class DaskExecutor:
    """Runs jobs of a study on all workers of a Dask cluster, as many at a time as they have threads.

    Each worker gets the files of the study, once. One that has another Shoal, Python or NumPy, or computes otherwise,
    is rejected: `on_notice` receives name and reason. Workers may join, leave and crash; their jobs are done elsewhere.
    Close it.

    Raises ValueError for what is no address, ModuleNotFoundError without the extra `cluster`, OSError if no scheduler
    answers.
    """

    def __init__(
        self, address: str, study: Study, *, wall_limit: float, on_notice: Callable[[str], None] = lambda _: None
    ):
        self._address, self._on_notice = address, on_notice
        place = to_dask_address(address)
        distributed = import_optional("distributed", "cluster")
        logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # its error is raised here
        try:
            self._client = distributed.Client(place, timeout=CONNECT, set_as_default=False, name="shoal")
        except (OSError, TimeoutError) as error:
            raise OSError(f"no scheduler of Dask answers at {address}: {format_exception_line(error)}") from None
        self._token = f"shoal-{uuid4().hex}"
        self._bundle = study.bundle.pack()
        self._study_order = {
            "study": str(study.file),
            "fixed": dict(study.fixed),
            "runs": study.design.runs or None,
            "digest": study.digest,
            "only_failed": study.logs == "failed",
            "wall_limit": wall_limit,
        }
        self._workers: dict[str, _DaskWorker] = {}
        self._refused: dict[str, str] = {}
        self._assigned: dict[str, _AssignedJob] = {}
        self._retries = deque[tuple[Job, int]]()
        self._done = SimpleQueue[str]()
        self._count = 0
        self._polled_at = -POLL_PERIOD
        self._alone_since = time.monotonic()

    def __enter__(self) -> "DaskExecutor":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End what is under way, and leave nothing on the workers."""
        self._cancel()
        if self._client.status == "running" and self._workers:
            replies: dict[str, Any] = {}
            with suppress(Exception):  # the scheduler has gone just now
                there = self._client.scheduler_info()["workers"]
                asked = [at for at in self._workers if at in there]
                replies = self._client.run(dask_worker.uninstall_study, self._token, workers=asked, on_error="return")
            for at, reply in replies.items():
                if isinstance(reply, Exception):
                    why = format_exception_line(reply)
                    self._on_notice(f"{at}: the study is still there, and its processes end later: {why}")
        with suppress(Exception):
            self._client.close(timeout=LEAVE)

    def run(self, jobs: Iterable[Job]) -> Generator[tuple[Job, ScenarioResult]]:
        """See `JobExecutor.run`. Raises OSError if the scheduler goes away, or no worker is left for `PATIENCE`."""
        coming = iter(jobs)
        try:
            while self._assign_jobs(coming):
                yield from self._wait_for_result()
                yield from self._give_up()
        finally:  # the caller may stop here
            self._retries.clear()
            self._cancel()

    def _assign_jobs(self, coming: Iterator[Job]) -> bool:
        """Give jobs to idle workers; False if no job is left or under way."""
        self._poll_workers()
        while (free := self._freest_worker()) is not None:
            job, deaths = self._retries.popleft() if self._retries else (next(coming, None), 0)
            if job is None:
                return bool(self._assigned)
            self._submit(job, deaths, free)
        if not self._assigned and not self._retries:  # no worker is left: without jobs that is no error
            job = next(coming, None)
            self._retries += [(job, 0)] if job is not None else []
        return bool(self._assigned or self._retries)

    def _freest_worker(self) -> str | None:
        """The worker with the most threads that have nothing to do."""
        free = {at: worker.threads - len(worker.assigned) for at, worker in self._workers.items()}
        best = max(free, key=free.__getitem__, default=None)
        return best if best is not None and free[best] > 0 else None

    def _submit(self, job: Job, deaths: int, at: str) -> None:
        self._count += 1
        key = f"{self._token}-{self._count}"
        future: Any = self._client.submit(
            *(dask_worker.run_job, self._token, encode_line(job_to_line(job))),
            key=key,
            workers=[at],
            allow_other_workers=False,
        )
        self._assigned[key] = _AssignedJob(job, at, deaths, future)
        self._workers[at].assigned.add(key)
        future.add_done_callback(partial(self._on_done, key))

    def _on_done(self, key: str, _: Any) -> None:
        self._done.put(key)

    def _wait_for_result(self) -> Iterator[tuple[Job, ScenarioResult]]:
        with suppress(Empty):
            key = self._done.get(timeout=POLL_PERIOD)
            entry = self._assigned.get(key)
            if entry is not None and (result := self._fetch(key, entry)) is not None:
                yield entry.job, result

    def _fetch(self, key: str, entry: _AssignedJob) -> ScenarioResult | None:
        """The result of an entry that is over; None if it has to be done again."""
        reply = self._wait_for_reply(key, entry)
        if key not in self._assigned:  # its worker has gone
            return None
        self._forget(key)
        if isinstance(reply, Exception):
            self._retries.append((entry.job, entry.deaths + 1))
            return None
        text, files = reply if reply is not None else (b"{}", [])
        line: JsonLine = json.loads(text)
        if reply is None or "refused" in line:  # without a reply the worker has started anew at the same address
            if line:
                self._refuse(entry.worker_address, self._workers[entry.worker_address].name, line["refused"])
            self._retries.append((entry.job, entry.deaths))
            self._drop(entry.worker_address, deaths=0)
            return None
        log_root = entry.job.log_root
        if log_root is not None:
            _write(log_root, files)
        return result_from_line(line, log_root)

    def _wait_for_reply(self, key: str, entry: _AssignedJob) -> dask_worker.JobReply | Exception | None:
        wait = FETCH
        while key in self._assigned:
            try:
                return entry.future.result(timeout=wait)
            except TimeoutError:  # a long log, or its worker has died with it
                wait *= 2.0
                self._poll_workers(at_once=True)
            except Exception as error:
                self._check()
                return error
        return None

    def _give_up(self) -> Iterator[tuple[Job, ScenarioResult]]:
        """The jobs with which too many workers have been lost."""
        for job, _ in [lost for lost in self._retries if lost[1] >= DEATHS]:
            yield job, job.failed_result(f"{DEATHS} workers, one after another, were lost with it", UnfinishedResult)
        self._retries = deque(lost for lost in self._retries if lost[1] < DEATHS)

    def _poll_workers(self, *, at_once: bool = False) -> None:
        """Update the list of workers. Raises OSError if the scheduler or the last worker has gone."""
        if time.monotonic() - self._polled_at < POLL_PERIOD and not at_once:
            return
        self._check()
        try:
            there = self._client.scheduler_info()["workers"]
        except Exception as error:
            raise self._scheduler_lost(format_exception_line(error)) from None
        for at in [at for at in self._workers if at not in there]:
            self._drop(at)
        self._refused = {at: why for at, why in self._refused.items() if at in there}
        self._check_new_workers(
            {at: about for at, about in there.items() if at not in self._workers and at not in self._refused}
        )
        self._polled_at = time.monotonic()
        if self._workers:
            self._alone_since = self._polled_at
        elif self._polled_at - self._alone_since > (POLL_PERIOD if self._refused and not self._count else PATIENCE):
            whys = "; ".join(self._refused.values()) or "it has none"
            raise OSError(f"no worker is left at {self._address} that could do a run: {whys}")

    def _check_new_workers(self, new: dict[str, Any]) -> None:
        """Let those workers do jobs that compute as this computer does."""
        describe = dask_worker.describe_worker
        reference = f"{describe.__module__}:{describe.__name__}"  # a name, since pickle needs a Shoal that has it
        self._call_on_workers(new, pkgutil.resolve_name, reference)
        for at, (name, theirs, computes) in self._call_on_workers(new, describe).items():
            if theirs != software_versions():
                self._refuse(at, name, f"it has {theirs}, and this is {software_versions()}")
            elif computes != compute_float_fingerprint():
                self._refuse(at, name, "its processor or libraries round otherwise than those of this computer")
            elif at in self._call_on_workers(
                {at: new[at]}, dask_worker.install_study, self._token, self._bundle, self._study_order
            ):
                self._workers[at] = _DaskWorker(name, max(1, int(new[at]["nthreads"])))

    def _call_on_workers(self, workers: dict[str, Any], function: Any, *given: object) -> dict[str, Any]:
        """Call a function on each of these workers and return the results; reject workers on which it fails."""
        asked = [at for at in workers if at not in self._refused]
        if not asked:
            return {}
        replies: dict[str, Any] = self._client.run(function, *given, workers=asked, on_error="return")
        for at, reply in replies.items():
            if isinstance(reply, ImportError | AttributeError):
                self._refuse(
                    at, str(workers[at]["name"]), f"it has no Shoal that can do this: {format_exception_line(reply)}"
                )
            elif isinstance(reply, Exception) and not isinstance(reply, OSError):
                self._refuse(at, str(workers[at]["name"]), f"{format_exception_line(reply)}")
        return {at: reply for at, reply in replies.items() if not isinstance(reply, Exception)}

    def _refuse(self, at: str, name: str, why: str) -> None:
        self._refused[at] = f"worker {name} ({at}) is rejected: {why}"
        self._on_notice(self._refused[at])

    def _drop(self, at: str, *, deaths: int = 1) -> None:
        """A worker that is not there any more, or may do no more jobs; others do those that it had."""
        for key in list(self._workers.pop(at).assigned):
            entry = self._assigned.pop(key)
            entry.future.cancel()
            self._retries.append((entry.job, entry.deaths + deaths))

    def _forget(self, key: str) -> None:
        entry = self._assigned.pop(key)
        if entry.worker_address in self._workers:
            self._workers[entry.worker_address].assigned.discard(key)

    def _cancel(self) -> None:
        for entry in self._assigned.values():
            with suppress(Exception):  # with the scheduler gone there is nothing to cancel
                entry.future.cancel()
        self._assigned.clear()
        for worker in self._workers.values():
            worker.assigned.clear()

    def _check(self) -> None:
        if self._client.status != "running":
            raise self._scheduler_lost("the connection is lost")

    def _scheduler_lost(self, why: str) -> OSError:
        return OSError(f"the scheduler at {self._address} has gone away: {why}; what is done stays")


def _write(folder: Path, files: Iterable[tuple[str, bytes]]) -> None:
    """Write logs that have come. Raises OSError, and ValueError for a path that leads out of the folder."""
    folder = folder.absolute()
    shutil.rmtree(folder, ignore_errors=True)  # of a run that was begun before
    for name, data in files:
        place = folder / name
        if ".." in Path(name).parts or not place.is_relative_to(folder):
            raise ValueError(f"a worker has sent a log with the path {name!r}")
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(data)
