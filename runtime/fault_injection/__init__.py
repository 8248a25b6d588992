"""Faults of tasks in simulation: what they publish is lost, stuck, shifted or noisy, or they fail."""

from runtime.fault_injection.faults import FaultInjector, Injection
from runtime.fault_injection.interceptor import PublishInterceptor
from runtime.fault_injection.kinds import Biased, Crash, Fault, FaultError, Noisy, Silent, Spoil, Stuck
from runtime.kernel import SimulatedCrash

__all__ = [
    "Biased",
    "Crash",
    "Fault",
    "FaultError",
    "FaultInjector",
    "Injection",
    "Noisy",
    "PublishInterceptor",
    "Silent",
    "SimulatedCrash",
    "Spoil",
    "Stuck",
]
