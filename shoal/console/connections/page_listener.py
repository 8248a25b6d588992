"""The socket of the page, which accepts so many connections only that files and links of the vehicle can be opened."""

import socket
from contextlib import suppress
from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

MOST_CONNECTIONS = 256
MOST_OF_ADDRESS = 96  # more than all pages and viewers of one computer
UNSENT = 1 << 18  # bytes that the system keeps for a slow reader, who would get old data from more


@dataclass
class _Connection:
    address: str
    is_waiting: bool = True  # for a whole request
    is_ended: bool = False


class PageListener(socket.socket):
    """Takes the place of a socket that listens, which is closed by that.

    There are 256 connections at most, and 96 from one address. Beyond, the one that has waited longest for a whole
    request makes room; if none waits, the new one is closed at once, before TLS. `rejected` counts those that were
    closed.
    """

    __slots__ = ("_numbers", "_opened", "rejected")

    def __init__(self, listener: socket.socket) -> None:
        super().__init__(listener.family, listener.type, listener.proto, listener.detach())
        self.setblocking(False)
        self.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, UNSENT)  # connections inherit it
        # asyncio sets it only for sockets that name their protocol; without it a body waits 40 ms for its head's ACK
        self.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._opened: WeakKeyDictionary[socket.socket, _Connection] = WeakKeyDictionary()
        self._numbers: dict[int, _Connection] = {}
        self.rejected: int = 0

    def accept(self) -> tuple[socket.socket, Any]:
        """Raises ConnectionAbortedError for one that is too many, as for one that has ended meanwhile."""
        accepted, place = super().accept()
        if not self._has_room(place[0]):
            self.rejected += 1
            accepted.close()
            raise ConnectionAbortedError("too many connections")
        self._opened[accepted] = self._numbers[accepted.fileno()] = _Connection(place[0])
        return accepted, place

    def set_waiting(self, number: int, *, is_waiting: bool) -> None:
        """Note whether the connection of a file descriptor waits for a whole request, or for its next one."""
        connection = self._numbers.get(number)
        if connection is not None:
            connection.is_waiting = is_waiting

    def _has_room(self, address: str) -> bool:
        """Whether one more connection of an address may be open; one that waits is closed for it."""
        opened = [(each, of) for each, of in self._opened.items() if each.fileno() >= 0 and not of.is_ended]
        of_address = [(each, of) for each, of in opened if of.address == address]
        if len(of_address) >= MOST_OF_ADDRESS:
            return self._end_oldest(of_address)
        return len(opened) < MOST_CONNECTIONS or self._end_oldest(opened)

    def _end_oldest(self, connections: list[tuple[socket.socket, _Connection]]) -> bool:
        """End the oldest connection that waits; whether there is one."""
        for each, of in connections:  # in the order of arrival
            if of.is_waiting:
                of.is_ended = True
                self.rejected += 1
                with suppress(OSError):  # it has ended meanwhile
                    each.shutdown(socket.SHUT_RDWR)
                return True
        return False
