"""Wakes a waiting kernel: sockets that can be read, and other threads."""

import os
import selectors
import socket
import sys
from collections.abc import Callable
from functools import partial
from io import FileIO

from runtime.kernel.timer import Readable, Timer

ONCE = (1).to_bytes(8, sys.byteorder)


class WakeUp:
    """Rings from any thread, and can be watched for that: Linux's eventfd(2), elsewhere a pair of sockets."""

    if sys.platform == "linux":

        def __init__(self) -> None:
            file = FileIO(os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC), "r+")
            self.ring: Callable[[], object] = partial(file.write, ONCE)
            self.silence: Callable[[], object] = partial(file.read, len(ONCE))
            self.fileno: Callable[[], int] = file.fileno
            self.close: Callable[[], None] = file.close

    else:

        def __init__(self) -> None:
            self._out, self._in = socket.socketpair()
            for end in (self._out, self._in):
                end.setblocking(False)
            self.fileno = self._out.fileno

        def ring(self) -> None:
            self._in.send(b"\0")

        def silence(self) -> None:
            self._out.recv(4096)  # what is left rings once more

        def close(self) -> None:
            self._out.close()
            self._in.close()


class WatchedSources:
    """Watched sockets, each with the call that it causes, and a bell by which any thread may `wake` the kernel."""

    def __init__(self):
        self.count: int = 0
        self._selector = selectors.DefaultSelector()
        self._bell = WakeUp()
        self._selector.register(self._bell, selectors.EVENT_READ, None)

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

    def unwatch_owner(self, owner: object) -> None:
        """Stop watching all sources of `owner`."""
        if not self.count:
            return
        for key in list(self._selector.get_map().values()):
            if key.data is not None and key.data.owner is owner:
                self.unwatch(key.fileobj)

    def wake(self) -> None:
        """End a wait, from any thread."""
        try:
            self._bell.ring()
        except (OSError, ValueError):
            pass  # it rings already, or there is no kernel any more

    def wait(self, timeout: float) -> list[Timer]:
        """Wait at most `timeout` seconds; the calls of sources that can be read, except those already queued."""
        found: list[Timer] = []
        for key, _ in self._selector.select(timeout):
            if key.data is None:
                self._bell.silence()
            elif not key.data.queued:
                key.data.queued = True
                found.append(key.data)
        return found

    def close(self) -> None:
        self._selector.close()
        self._bell.close()
