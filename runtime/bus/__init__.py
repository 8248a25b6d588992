"""Delivers messages within a process, and through transports to others."""

from runtime.bus.bus import Bus
from runtime.bus.contract import BusInstrument, Subscription, Transport
from runtime.bus.excess import Excess
from runtime.bus.frame import Frame
from runtime.bus.inbox import Request
from runtime.bus.passages import known_here

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
