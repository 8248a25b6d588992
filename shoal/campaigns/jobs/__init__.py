"""Single runs: jobs, the processes that do them, and their result rows."""

from shoal.campaigns.jobs.cpu_timing import TimedResult, TimedRunner, make_timed_runner
from shoal.campaigns.jobs.executor import JobExecutor
from shoal.campaigns.jobs.job import SCENARIO_SUFFIX, Job, RunJob, UnfinishedResult, UnreadableResult
from shoal.campaigns.jobs.pool import WALL_LIMIT, ProcessPool, usable_cpus
from shoal.campaigns.jobs.result_row import ResultRow, column_names, is_finished, make_row, unpack_track
from shoal.campaigns.jobs.runner import ScenarioRunner, StudyRunner

__all__ = [
    "SCENARIO_SUFFIX",
    "WALL_LIMIT",
    "Job",
    "JobExecutor",
    "ProcessPool",
    "ResultRow",
    "RunJob",
    "ScenarioRunner",
    "StudyRunner",
    "TimedResult",
    "TimedRunner",
    "UnfinishedResult",
    "UnreadableResult",
    "column_names",
    "is_finished",
    "make_row",
    "make_timed_runner",
    "unpack_track",
    "usable_cpus",
]
