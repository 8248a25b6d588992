"""Faults of tasks in simulation: what they publish is lost, stuck, shifted or noisy, or they fail."""

from runtime.faults.faults import Faults, Injection
from runtime.faults.kinds import Biased, Crash, Fault, FaultError, Noisy, Silent, Spoil, Stuck
from runtime.faults.source import Source
from runtime.kernel import SimulatedCrash

__all__ = [
    "Biased",
    "Crash",
    "Fault",
    "FaultError",
    "Faults",
    "Injection",
    "Noisy",
    "Silent",
    "SimulatedCrash",
    "Source",
    "Spoil",
    "Stuck",
]
