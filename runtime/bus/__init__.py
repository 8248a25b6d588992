"""Delivers messages within a process, and through transports to others."""

from runtime.bus.bus import Bus, BusInstrument, Subscription, Transport, known_here
from runtime.bus.excess import Excess
from runtime.bus.frame import Frame
from runtime.bus.inbox import Request

__all__ = [
    "Bus",
    "BusInstrument",
    "Excess",
    "Frame",
    "Request",
    "Subscription",
    "Transport",
    "known_here",
]
