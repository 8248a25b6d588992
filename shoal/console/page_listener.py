"""The socket of the page, which accepts so many connections only that files and links of the vehicle can be opened."""

import socket
from typing import Any
from weakref import WeakKeyDictionary

MOST_CONNECTIONS = 256
MOST_OF_ADDRESS = 96  # more than all pages and viewers of one computer
UNSENT = 1 << 18  # bytes that the system keeps for a slow reader, who would get old data from more


class PageListener(socket.socket):
    """Takes the place of a socket that listens, which is closed by that.

    Connections beyond 256, and beyond 96 from one address, are closed at once, before TLS: `rejected` counts them.
    """

    __slots__ = ("_opened", "rejected")

    def __init__(self, listener: socket.socket) -> None:
        super().__init__(listener.family, listener.type, listener.proto, listener.detach())
        self.setblocking(False)
        self.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, UNSENT)  # connections inherit it
        self._opened: WeakKeyDictionary[socket.socket, str] = WeakKeyDictionary()
        self.rejected: int = 0

    def accept(self) -> tuple[socket.socket, Any]:
        """Raises ConnectionAbortedError for one that is too many, as for one that has ended meanwhile."""
        accepted, place = super().accept()
        addresses = [address for each, address in self._opened.items() if each.fileno() >= 0]
        if len(addresses) >= MOST_CONNECTIONS or addresses.count(place[0]) >= MOST_OF_ADDRESS:
            self.rejected += 1
            accepted.close()
            raise ConnectionAbortedError("too many connections")
        self._opened[accepted] = place[0]
        return accepted, place
