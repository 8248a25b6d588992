"""Single runs: what one is, the processes that do them, and the row that comes of each."""

from shoal.campaigns.jobs.engine import Engine
from shoal.campaigns.jobs.job import SUFFIX, Do, Job, Unfinished, Unreadable
from shoal.campaigns.jobs.pool import WALL_LIMIT, Pool, processors
from shoal.campaigns.jobs.rows import Row, columns_of, is_finished, row_of, track_of
from shoal.campaigns.jobs.runner import Runner
from shoal.campaigns.jobs.stopwatch import Timed, Timing, timing
from shoal.campaigns.jobs.study_runner import StudyRunner

__all__ = [
    "SUFFIX",
    "WALL_LIMIT",
    "Do",
    "Engine",
    "Job",
    "Pool",
    "Row",
    "Runner",
    "StudyRunner",
    "Timed",
    "Timing",
    "Unfinished",
    "Unreadable",
    "columns_of",
    "is_finished",
    "processors",
    "row_of",
    "timing",
    "track_of",
]
