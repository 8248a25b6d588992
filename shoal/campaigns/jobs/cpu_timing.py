"""Runs jobs and measures the time of each."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from shoal.campaigns.jobs.job import Job, RunJob, UnfinishedResult, UnreadableResult
from shoal.scenarios import ScenarioResult


@dataclass(frozen=True)
class TimedResult(ScenarioResult):
    """A result with the CPU seconds that its run took."""

    cpu: float = field(default=0.0, compare=False)


@dataclass
class TimedRunner:
    """Calls `run_job` and measures the time. With `only_failed` a run that passes keeps no log: it is run
    without one first, which is faster, and once more if it fails."""

    run_job: RunJob
    only_failed: bool

    def __call__(self, job: Job) -> ScenarioResult:
        started = time.process_time()
        first = replace(job, log_root=None) if self.only_failed else job
        result = self.run_job(first)
        cpu = time.process_time() - started
        if isinstance(result, UnfinishedResult | UnreadableResult):
            return result
        if self.only_failed and not result.passed:
            result = self.run_job(job)
        return TimedResult(**vars(result), cpu=cpu)


def make_timed_runner(make_runner: Callable[[], RunJob], only_failed: bool) -> TimedRunner:
    """Makes in a process what does the jobs there."""
    return TimedRunner(make_runner(), only_failed)
