"""Campaigns: many runs of scenarios, what varies in them, and what they show."""

from shoal.campaigns.job import SUFFIX, Do, Job, Unfinished, Unreadable
from shoal.campaigns.pool import WALL_LIMIT, Pool, processors
from shoal.campaigns.runner import Runner

__all__ = ["SUFFIX", "WALL_LIMIT", "Do", "Job", "Pool", "Runner", "Unfinished", "Unreadable", "processors"]
