"""A transport that joins the buses of several processes."""

from runtime.zenoh.config import LOCAL_PORT, ZenohConfig, configured_endpoints, error_text
from runtime.zenoh.failover_listener import FailoverListener
from runtime.zenoh.key_expressions import key_chunk, message_key
from runtime.zenoh.presence import DAEMON, ProcessPart, this_host
from runtime.zenoh.presence import parse_token as parse_token
from runtime.zenoh.session_factory import SessionFactory
from runtime.zenoh.transport import ZenohTransport

__all__ = [
    "DAEMON",
    "LOCAL_PORT",
    "FailoverListener",
    "ProcessPart",
    "SessionFactory",
    "ZenohConfig",
    "ZenohTransport",
    "configured_endpoints",
    "error_text",
    "key_chunk",
    "message_key",
    "parse_token",
    "this_host",
]
