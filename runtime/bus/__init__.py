"""Delivers messages within a process, and through transports to others."""

from runtime.bus.bus import Bus
from runtime.bus.camera_frame import Frame
from runtime.bus.codec_roundtrip import local_class
from runtime.bus.drop_counter import DropCounter
from runtime.bus.inbox import Request
from runtime.bus.interfaces import BusObserver, Subscription, Transport

__all__ = [
    "Bus",
    "BusObserver",
    "DropCounter",
    "Frame",
    "Request",
    "Subscription",
    "Transport",
    "local_class",
]
