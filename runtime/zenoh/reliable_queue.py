"""Sends what must not be lost, from a thread of its own: it may wait for a slow receiver, the kernel never does."""

import threading
from collections import deque
from collections.abc import Callable

from runtime.zenoh.error_counter import ErrorCounter

MOST_WAITING = 256
PATIENCE = 0.5  # s to send what waits when the bus is left

Send = Callable[[], object]


class ReliableQueue:
    """A bounded queue of things to send, in order, and the thread that sends them.

    What does not fit is counted in `unsent`, as what zenoh rejects.
    """

    def __init__(self, unsent: ErrorCounter) -> None:
        self._unsent = unsent
        self._waiting: deque[tuple[str, Send]] = deque()
        self._changed = threading.Condition()
        self._closing = False
        self._thread = threading.Thread(target=self._run, name="zenoh outbox", daemon=True)

    def open(self) -> None:
        self._thread.start()

    def put(self, what: str, send: Send) -> None:
        """Let `send` be called soon; `what` names it if it cannot be sent."""
        with self._changed:
            if self._closing:
                return
            full = len(self._waiting) >= MOST_WAITING
            if not full:
                self._waiting.append((what, send))
                self._changed.notify()
        if full:
            self._unsent.count(f"{what}: {MOST_WAITING} wait already, since somebody does not receive")

    def close(self) -> None:
        """Send what waits, for PATIENCE seconds, and end."""
        with self._changed:
            self._closing = True
            self._changed.notify()
        if self._thread.is_alive():
            self._thread.join(PATIENCE)

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._waiting or self._closing)
                if not self._waiting:
                    return
                what, send = self._waiting.popleft()
            try:
                send()
            except Exception as error:
                self._unsent.count(f"{what}: {error}")
