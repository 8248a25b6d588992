"""A transport that joins the buses of several processes."""

from runtime.zenoh.config import ZenohConfig
from runtime.zenoh.keys import chunk
from runtime.zenoh.meeting import MeetingPoint
from runtime.zenoh.presence import Part
from runtime.zenoh.transport import ZenohTransport

__all__ = [
    "MeetingPoint",
    "Part",
    "ZenohConfig",
    "ZenohTransport",
    "chunk",
]
