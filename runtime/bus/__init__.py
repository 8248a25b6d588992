"""Delivers messages within a process, and through transports to others."""

from runtime.bus.bus import Bus
from runtime.bus.camera_frame import Frame
from runtime.bus.codec_roundtrip import known_here
from runtime.bus.drop_counter import Excess
from runtime.bus.inbox import Request
from runtime.bus.interfaces import BusInstrument, Subscription, Transport

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
