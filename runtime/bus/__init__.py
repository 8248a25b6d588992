"""Delivers messages within a process, and through transports to others."""

from runtime.bus.bus import Bus
from runtime.bus.camera_frame import Frame
from runtime.bus.codec_roundtrip import find_equivalent_class
from runtime.bus.drop_counter import DropCounter
from runtime.bus.interfaces import BusObserver, Subscription, Transport
from runtime.bus.packet_inbox import Request

__all__ = [
    "Bus",
    "BusObserver",
    "DropCounter",
    "Frame",
    "Request",
    "Subscription",
    "Transport",
    "find_equivalent_class",
]
