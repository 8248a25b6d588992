"""Re-simulation: tasks run again on what a log has of all the others."""

from runtime.resim.comparison import Comparison, Difference, FieldStatistics, Tally
from runtime.resim.rerun import Resimulation, ResimulationError, resimulate

__all__ = [
    "Comparison",
    "Difference",
    "FieldStatistics",
    "Resimulation",
    "ResimulationError",
    "Tally",
    "resimulate",
]
