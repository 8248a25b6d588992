"""Interface of an executor: processes of this computer, or a cluster."""

from collections.abc import Generator, Iterable
from typing import Protocol

from shoal.campaigns.jobs.job import Job
from shoal.scenarios import ScenarioResult


class JobExecutor(Protocol):
    """Runs jobs, here or on other computers; one caller at a time."""

    def run(self, jobs: Iterable[Job]) -> Generator[tuple[Job, ScenarioResult]]:
        """Each job with its result, once, in the order of completion.

        A job is asked for when there is somebody for it. One whose process or computer is lost is done elsewhere; one
        that takes too long, or of which several processes die, has an UnfinishedResult. Logs are in `log_root` of
        the job, on this computer. The same job has the same result on every engine. The caller may leave at any
        moment. Raises OSError when no worker is left.
        """
        ...
