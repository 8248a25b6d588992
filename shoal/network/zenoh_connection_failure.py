"""The reason why zenoh did not connect, which it does not report."""

import socket
from collections.abc import Collection
from contextlib import suppress

OVER_TCP = ("tcp", "tls", "ws")
ACCEPTING = 0.5  # s for an endpoint to accept a connection
REFUSED = (
    "it needs a certificate of its own authority, or a user and password; or its certificate is of another authority; "
    "or it is stopped, or not zenoh"
)


def connection_failure(endpoints: Collection[str]) -> str:
    """Reason why no connection was made: nothing listens at the endpoints, or the program there rejected it."""
    accepting: list[str] = []
    for endpoint in endpoints:
        protocol, _, place = endpoint.partition("/")
        host, _, port = place.partition("?")[0].partition("#")[0].rpartition(":")
        with suppress(OSError, ValueError):
            if protocol in OVER_TCP:
                socket.create_connection((host.strip("[]"), int(port)), ACCEPTING).close()
                accepting.append(endpoint)
    if accepting:
        return f"{', '.join(accepting)} did not accept us: {REFUSED}"
    unsure = any(endpoint.startswith("quic/") for endpoint in endpoints)
    return f"nothing listens at {', '.join(endpoints)}" + (f", or did not accept us: {REFUSED}" if unsure else "")
