"""Re-runs part of a log: tasks on the messages of all others, or a whole vehicle from a moment on."""

from shoal.rerun.comparison import EntityMessage, FieldStatistics, FirstDifference, MessageCount, RerunComparison
from shoal.rerun.log_summary import summarize_log
from shoal.rerun.logged_packet_times import TimestampResolver
from shoal.rerun.resimulation import Resimulation, ResimulationError, logged_profile, resimulate, tick_rates
from shoal.rerun.rewind import RewoundRun, resume_snapshot
from shoal.rerun.run_log_sequence import LoggedRun, find_run_of_log

__all__ = [
    "EntityMessage",
    "FieldStatistics",
    "FirstDifference",
    "LoggedRun",
    "MessageCount",
    "RerunComparison",
    "Resimulation",
    "ResimulationError",
    "RewoundRun",
    "TimestampResolver",
    "find_run_of_log",
    "logged_profile",
    "resimulate",
    "resume_snapshot",
    "summarize_log",
    "tick_rates",
]
