"""Runs part of a log again: tasks on what all others said, or a vehicle from a moment on."""

from shoal.rerun.comparison import Comparison, Difference, FieldStatistics, Tally
from shoal.rerun.history import Instants
from shoal.rerun.outlines import outline
from shoal.rerun.resimulation import Resimulation, ResimulationError, resimulate
from shoal.rerun.rewind import Rewound, continued

__all__ = [
    "Comparison",
    "Difference",
    "FieldStatistics",
    "Instants",
    "Resimulation",
    "ResimulationError",
    "Rewound",
    "Tally",
    "continued",
    "outline",
    "resimulate",
]
