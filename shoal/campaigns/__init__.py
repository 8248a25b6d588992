"""Campaigns: many runs of scenarios, what varies in them, and what they show."""

from shoal.campaigns.job import SUFFIX, Do, Job, Unfinished, Unreadable
from shoal.campaigns.junit import junit_xml
from shoal.campaigns.pool import WALL_LIMIT, Pool, processors
from shoal.campaigns.runner import Runner
from shoal.campaigns.suite import Outcome, find_scenarios, log_again, run_jobs
from shoal.campaigns.telling import details_of, facts_of, failures_of, warnings_of

__all__ = [
    "SUFFIX",
    "WALL_LIMIT",
    "Do",
    "Job",
    "Outcome",
    "Pool",
    "Runner",
    "Unfinished",
    "Unreadable",
    "details_of",
    "facts_of",
    "failures_of",
    "find_scenarios",
    "junit_xml",
    "log_again",
    "processors",
    "run_jobs",
    "warnings_of",
]
