"""Campaigns: many runs of scenarios, what varies in them, and what they show."""

from shoal.campaigns.job import Do, Job, Unreadable
from shoal.campaigns.pool import Pool, processors

__all__ = ["Do", "Job", "Pool", "Unreadable", "processors"]
