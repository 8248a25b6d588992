"""Re-runs part of a log: tasks on the messages of all others, or a whole vehicle from a moment on."""

from shoal.rerun.comparison import Comparison, FieldStatistics, FirstDifference, Key, MessageCount
from shoal.rerun.history import Instants
from shoal.rerun.outlines import outline
from shoal.rerun.resimulation import Resimulation, ResimulationError, resimulate
from shoal.rerun.rewind import Rewound, continued

__all__ = [
    "Comparison",
    "FieldStatistics",
    "FirstDifference",
    "Instants",
    "Key",
    "MessageCount",
    "Resimulation",
    "ResimulationError",
    "Rewound",
    "continued",
    "outline",
    "resimulate",
]
