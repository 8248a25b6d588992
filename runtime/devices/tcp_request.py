"""A TCP server that answers requests one by one, asked from a worker."""

import socket
import time
from collections.abc import Callable
from contextlib import suppress

MOST_AT_ONCE = 1 << 20  # bytes per system call
LARGEST_ANSWER = 1 << 27  # bytes

Complete = Callable[[bytearray], bool]
"""Whether some bytes are a whole answer; called as more arrive. Raises ValueError for what can be none."""


class TcpRequester:
    """A connection to `host` and `port` that `request` opens when there is none; any failure ends it.

    `request` waits, so call it where `Task.offload` computes, never in a handler, and one at a time. `close` may be
    called from any thread: it ends a wait for good. `timeout` is in s, for each answer as a whole, and for the
    connection.
    """

    def __init__(self, host: str, port: int, timeout: float):
        self.name: str = f"{host}:{port}"
        self._address = host, port
        self._timeout = timeout
        self._socket: socket.socket | None = None
        self._closed = False

    @property
    def is_open(self) -> bool:
        return self._socket is not None

    def request(self, request: bytes, complete: Complete) -> bytearray:
        """The answer to a request. Raises OSError, or ValueError from `complete`, or for too long an answer."""
        try:
            return self._ask(request, complete)
        except BaseException:
            self.disconnect()
            raise

    def disconnect(self) -> None:
        """End the connection; the next request opens another one."""
        opened, self._socket = self._socket, None
        if opened is not None:
            with suppress(OSError):
                opened.shutdown(socket.SHUT_RDWR)  # wakes a thread that waits in it, which closing alone does not
            opened.close()

    def close(self) -> None:
        self._closed = True
        self.disconnect()

    def open(self) -> None:
        """Connect, unless it is connected. Raises OSError."""
        if self._closed:
            raise ConnectionAbortedError("closed")
        if self._socket is None:
            try:
                opened = socket.create_connection(self._address, self._timeout)
            except TimeoutError:
                raise TimeoutError(f"no connection within {self._timeout:g} s") from None
            opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._socket = opened
            if self._closed:
                self.disconnect()
                raise ConnectionAbortedError("closed")

    def _ask(self, request: bytes, complete: Complete) -> bytearray:
        self.open()
        opened = self._socket
        if opened is None:
            raise ConnectionAbortedError("closed")
        end, answer = time.monotonic() + self._timeout, bytearray()
        try:
            opened.settimeout(self._timeout)
            opened.sendall(request)
            while not complete(answer):
                opened.settimeout(max(1e-3, end - time.monotonic()))
                data = opened.recv(MOST_AT_ONCE)
                if not data:
                    raise ConnectionResetError("the other side has closed the connection")
                answer += data
                if len(answer) > LARGEST_ANSWER:
                    raise ValueError(f"an answer of more than {LARGEST_ANSWER >> 20} MiB")
                if time.monotonic() > end:
                    raise TimeoutError
        except TimeoutError:
            raise TimeoutError(f"no answer within {self._timeout:g} s") from None
        return answer
