"""A transport that joins the buses of several processes."""

from runtime.zenoh.config import LOCAL_PORT, ZenohConfig, endpoints_in, explain
from runtime.zenoh.keys import chunk, key
from runtime.zenoh.meeting import MeetingPoint
from runtime.zenoh.memory import Opener
from runtime.zenoh.presence import DAEMON, Part, here
from runtime.zenoh.presence import parse as parse_token
from runtime.zenoh.transport import ZenohTransport

__all__ = [
    "DAEMON",
    "LOCAL_PORT",
    "MeetingPoint",
    "Opener",
    "Part",
    "ZenohConfig",
    "ZenohTransport",
    "chunk",
    "endpoints_in",
    "explain",
    "here",
    "key",
    "parse_token",
]
