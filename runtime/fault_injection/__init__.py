"""Faults of tasks in simulation: what they publish is lost, stuck, shifted or noisy, or they fail."""

from runtime.fault_injection.fault_injector import FaultInjector, Injection
from runtime.fault_injection.fault_kinds import Biased, Crash, Fault, FaultError, Noisy, PublishFilter, Silent, Stuck
from runtime.fault_injection.interceptor import PublishInterceptor
from runtime.kernel import SimulatedCrash

__all__ = [
    "Biased",
    "Crash",
    "Fault",
    "FaultError",
    "FaultInjector",
    "Injection",
    "Noisy",
    "PublishFilter",
    "PublishInterceptor",
    "Silent",
    "SimulatedCrash",
    "Stuck",
]
