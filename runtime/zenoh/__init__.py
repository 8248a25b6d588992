"""A transport that joins the buses of several processes."""

from runtime.zenoh.config import LOCAL_PORT, ZenohConfig, endpoints_in, explain
from runtime.zenoh.key_expressions import chunk, key
from runtime.zenoh.presence import DAEMON, Part, here
from runtime.zenoh.presence import parse as parse_token
from runtime.zenoh.rendezvous import MeetingPoint
from runtime.zenoh.session_factory import Opener
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
