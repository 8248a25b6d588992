"""Re-runs part of a log: tasks on the messages of all others, or a whole vehicle from a moment on."""

from shoal.rerun.comparison import Comparison, FieldStatistics, FirstDifference, Key, MessageCount
from shoal.rerun.log_summary import outline
from shoal.rerun.logged_packets import Instants
from shoal.rerun.logged_run import LoggedRun, run_of
from shoal.rerun.resimulation import Resimulation, ResimulationError, profile_of, resimulate, tick_rates
from shoal.rerun.rewind import Rewound, continued

__all__ = [
    "Comparison",
    "FieldStatistics",
    "FirstDifference",
    "Instants",
    "Key",
    "LoggedRun",
    "MessageCount",
    "Resimulation",
    "ResimulationError",
    "Rewound",
    "continued",
    "outline",
    "profile_of",
    "resimulate",
    "run_of",
    "tick_rates",
]
