"""Does jobs and takes the time that each of them needs."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from shoal.campaigns.jobs.job import Do, Job, Unfinished, Unreadable
from shoal.scenarios import ScenarioResult


@dataclass(frozen=True)
class Timed(ScenarioResult):
    """A result with the CPU seconds that its run took."""

    cpu: float = field(default=0.0, compare=False)


@dataclass
class Timing:
    """Does what `do` does, and takes the time. With `only_failed` a run that passes keeps no log: it is run without
    one first, which is faster, and once more if it fails."""

    do: Do
    only_failed: bool

    def __call__(self, job: Job) -> ScenarioResult:
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
