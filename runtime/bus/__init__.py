"""Delivers messages within a process, and through transports to others."""

from runtime.bus.bus import Bus, BusInstrument, Subscription, Transport, known_here
from runtime.bus.excess import Excess
from runtime.bus.frame import Frame

__all__ = [
    "Bus",
    "BusInstrument",
    "Excess",
    "Frame",
    "Subscription",
    "Transport",
    "known_here",
]
