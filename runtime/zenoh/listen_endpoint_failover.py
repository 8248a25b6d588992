"""The ports that the processes of a computer share: one of them listens; when it ends, another takes over."""

import errno
import logging
import os
import re
import socket
import threading
from typing import TYPE_CHECKING, Any, cast

from runtime.zenoh.config import ZenohConfig, error_text, is_loopback_endpoint, set_option
from runtime.zenoh.session_factory import SessionFactory

if TYPE_CHECKING:
    import zenoh

PERIOD = 0.5  # s

logger: logging.Logger = logging.getLogger("shoal.zenoh")


class ListenEndpointFailover:
    """Listens at the fixed endpoints of a configuration as soon as no other process does.

    It has its own zenoh sessions, because zenoh can neither start to listen in an open session, nor close a session
    that waits for a port. They serve the clients that connect there.
    """

    def __init__(self, config: ZenohConfig, opener: SessionFactory) -> None:
        self._config = config
        self._session_factory = opener
        self._wanted: list[str] = []
        self._sessions: list[zenoh.Session] = []
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="zenoh meeting point", daemon=True)

    def open(self) -> None:
        """Listen at the free endpoints. Raises ConnectionError if zenoh cannot, for example without a certificate."""
        self._wanted = self._config.build().fixed
        self._listen()
        if self._wanted:
            self._thread.start()

    def close(self) -> None:
        self._closing.set()
        if self._thread.is_alive():
            self._thread.join()
        while self._sessions:
            cast(Any, self._sessions.pop()).close()

    def _watch(self) -> None:
        while self._wanted and not self._closing.wait(PERIOD):
            try:
                self._listen()
            except ConnectionError as error:
                logger.warning("%s", error)
                return

    def _listen(self) -> None:
        import zenoh

        free = [endpoint for endpoint in self._wanted if not is_in_use(endpoint)]
        if not free:
            return
        config = self._config.build().config
        set_option(config, "id", None)  # an id in the configuration file is that of the session of packets
        set_option(config, "listen/endpoints", free)
        if not all(map(is_loopback_endpoint, free)):
            set_option(config, "mode", "router")  # a peer passes nothing on to the peers of other computers
        set_option(config, "connect/endpoints", [])
        set_option(config, "open/return_conditions/connect_scouted", False)
        try:
            self._sessions.append(self._session_factory.open(config))
        except zenoh.ZError as error:
            if not any(map(is_in_use, free)):
                raise ConnectionError(f"zenoh cannot listen at {', '.join(free)}: {error_text(error)}") from None
            return  # another process was faster
        self._wanted = [endpoint for endpoint in self._wanted if endpoint not in free]


def is_in_use(endpoint: str) -> bool:
    """Whether a process listens at an endpoint."""
    protocol, _, rest = endpoint.partition("/")
    host, _, port = re.split(r"[?#]", rest)[0].rpartition(":")
    kind = socket.SOCK_DGRAM if protocol in ("udp", "quic") else socket.SOCK_STREAM
    try:
        places = socket.getaddrinfo(host.strip("[]"), port, type=kind, flags=socket.AI_PASSIVE)
        for family, _, _, _, address in places:
            with socket.socket(family, kind) as probe:
                # A port in TIME_WAIT counts as free. On Windows this option would also take a port from its listener.
                if os.name == "posix" and kind == socket.SOCK_STREAM:
                    probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                probe.bind(address)
    except OSError as error:
        return error.errno == errno.EADDRINUSE
    return False
