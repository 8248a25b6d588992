"""Ends links to other computers that are silent for some seconds, so that they can be made again.

zenoh ends a silent link after LEASE, but waits until what it wrote last has left. Behind a cut cable that takes TLS up
to a minute, and when the cable is back, the operating system sends again only after another. TCP_USER_TIMEOUT (RFC
5482) ends such a connection. zenoh has no setting for it, so it is set here, at the sockets that zenoh has opened.
"""

import contextlib
import os
import re
import socket
import threading
from typing import TYPE_CHECKING, Any

from runtime.zenoh.config import LEASE, is_loopback_endpoint

if TYPE_CHECKING:
    import zenoh

LONGEST = LEASE  # ms; with zenoh's sign of life each 1.5 s, a cut is noticed in less than 10 s
PERIOD = 1.0  # s
SOCKETS = "/proc/self/fd"
POSSIBLE = hasattr(socket, "TCP_USER_TIMEOUT") and os.path.isdir(SOCKETS)

End = tuple[str, int]


class LinkTimeout:
    """Sets the limit at each link of the watched sessions that leads beyond this computer."""

    def __init__(self) -> None:
        self._sessions: list[zenoh.Session] = []
        self._limited: set[tuple[End, End]] = set()
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None

    def add_session(self, session: "zenoh.Session") -> None:
        self._sessions.append(session)
        if POSSIBLE and self._thread is None:
            self._thread = threading.Thread(target=self._work, name="zenoh silence", daemon=True)
            self._thread.start()

    def close(self) -> None:
        """Call it before the sessions are closed."""
        self._closing.set()
        if self._thread is not None:
            self._thread.join()
        self._sessions.clear()

    def _work(self) -> None:
        while not self._closing.wait(PERIOD):
            links = {link for session in list(self._sessions) for link in _links(session)}
            self._limited &= links
            if links - self._limited:
                self._limited |= set_timeout(links - self._limited)


def set_timeout(links: set[tuple[End, End]]) -> set[tuple[End, End]]:
    """Set the limit at the sockets of this process between these ends; returns those that have it."""
    found: set[tuple[End, End]] = set()
    for name in os.listdir(SOCKETS):
        with contextlib.suppress(OSError):  # closed meanwhile, or no TCP socket
            if not os.readlink(f"{SOCKETS}/{name}").startswith("socket:"):
                continue
            with socket.socket(fileno=os.dup(int(name))) as opened:
                if opened.family not in (socket.AF_INET, socket.AF_INET6) or opened.type != socket.SOCK_STREAM:
                    continue
                ends = _end(*opened.getsockname()[:2]), _end(*opened.getpeername()[:2])
                if ends in links:
                    opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, LONGEST)
                    found.add(ends)
    return found


def _links(session: "zenoh.Session") -> list[tuple[End, End]]:
    """Both ends, here and there, of the links of a session to other computers."""
    import zenoh

    try:
        links: Any = session.info.links()
    except zenoh.ZError:  # it is closed
        return []
    return [
        (_locator(str(link.src)), _locator(str(link.dst))) for link in links if not is_loopback_endpoint(str(link.dst))
    ]


def _locator(text: str) -> End:
    host, _, port = re.split(r"[?#]", text.partition("/")[2])[0].rpartition(":")
    return _end(host, int(port) if port.isdigit() else 0)


def _end(host: str, port: int) -> End:
    return host.strip("[]").partition("%")[0], port
