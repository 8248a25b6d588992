"""Wakes a waiting kernel: sockets that can be read, and other threads."""

import selectors
import socket
from collections.abc import Callable

from runtime.kernel.timer import Readable, Timer


class Sources:
    """Watched sockets, each with the call that it causes, and a pipe through which any thread may `wake` the kernel."""

    def __init__(self):
        self.count = 0
        self._selector = selectors.DefaultSelector()
        self._wake_in, self._wake_out = socket.socketpair()
        for end in (self._wake_in, self._wake_out):
            end.setblocking(False)
        self._selector.register(self._wake_in, selectors.EVENT_READ, None)

    def watch(self, source: Readable, function: Callable[[], object]) -> Timer:
        """The call for when `source` has something to read. Raises KeyError if it is watched already."""
        timer = Timer(0, function, ())
        self._selector.register(source, selectors.EVENT_READ, timer)
        self.count += 1
        return timer

    def unwatch(self, source: Readable | int) -> None:
        """Stop watching and drop a pending call; does nothing if the source is not watched."""
        try:
            key = self._selector.unregister(source)
        except (KeyError, ValueError):
            return
        key.data.cancel()
        self.count -= 1

    def discard(self, owner: object) -> None:
        """Stop watching all sources of `owner`."""
        if not self.count:
            return
        for key in list(self._selector.get_map().values()):
            if key.data is not None and key.data.owner is owner:
                self.unwatch(key.fileobj)

    def wake(self) -> None:
        """End a wait, from any thread."""
        try:
            self._wake_out.send(b"\0")
        except OSError:
            pass  # a full pipe wakes the kernel anyway; after `close` there is no kernel to wake

    def wait(self, timeout: float) -> list[Timer]:
        """Wait at most `timeout` seconds; the calls of sources that can be read, except those already queued."""
        found: list[Timer] = []
        for key, _ in self._selector.select(timeout):
            if key.data is None:
                self._drain()
            elif not key.data.queued:
                key.data.queued = True
                found.append(key.data)
        return found

    def close(self) -> None:
        self._selector.close()
        self._wake_in.close()
        self._wake_out.close()

    def _drain(self) -> None:
        try:
            while self._wake_in.recv(4096):
                pass
        except BlockingIOError:
            pass
