"""A transport that joins the buses of several processes."""

from runtime.zenoh.config import LOCAL_PORT, ZenohConfig, error_text, is_loopback_endpoint, read_connect_endpoints
from runtime.zenoh.key_expressions import key_chunk, message_key
from runtime.zenoh.listen_endpoint_failover import ListenEndpointFailover
from runtime.zenoh.presence import DAEMON, ProcessPart, describe_local_host
from runtime.zenoh.presence import parse_token as parse_token
from runtime.zenoh.session_factory import SessionFactory
from runtime.zenoh.transport import ZenohTransport

__all__ = [
    "DAEMON",
    "LOCAL_PORT",
    "ListenEndpointFailover",
    "ProcessPart",
    "SessionFactory",
    "ZenohConfig",
    "ZenohTransport",
    "describe_local_host",
    "error_text",
    "is_loopback_endpoint",
    "key_chunk",
    "message_key",
    "parse_token",
    "read_connect_endpoints",
]
