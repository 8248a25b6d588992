"""The threads for heavy work on a wall clock. They never keep a process from ending."""

import time
from collections.abc import Callable
from queue import SimpleQueue
from threading import Thread

THREADS = 2
Work = tuple[str, Callable[[], object]]


class WorkerThreads:
    """Two threads that do what is submitted, in its order."""

    def __init__(self, name: str):
        self._name = name
        self._queue: SimpleQueue[Work | None] = SimpleQueue()
        self._doing: list[tuple[str, float] | None] = [None] * THREADS
        self._threads: list[Thread] = []

    def submit(self, title: str, work: Callable[[], object]) -> None:
        """Do `work`, which must not raise; `title` names it in warnings."""
        if not self._threads:
            for number in range(THREADS):
                # A thread of the standard library's pool would be waited for at the end of the process, for ever.
                name = f"{self._name}-worker-{number}"
                self._threads.append(Thread(target=self._run, args=(number,), name=name, daemon=True))
                self._threads[-1].start()
        self._queue.put((title, work))

    def current_work(self) -> list[tuple[str, float]]:
        """The present work, and its duration so far (s)."""
        now = time.monotonic()
        return [(item[0], now - item[1]) for item in list(self._doing) if item is not None]

    def close(self, patience: float) -> list[str]:
        """Drop what has not begun, and wait at most `patience` s for the rest; the titles of what still runs then."""
        while not self._queue.empty():
            self._queue.get()
        for _ in self._threads:
            self._queue.put(None)
        end = time.monotonic() + patience
        for thread in self._threads:
            thread.join(max(0.0, end - time.monotonic()))
        return [title for title, _ in self.current_work()]

    def _run(self, number: int) -> None:
        while (item := self._queue.get()) is not None:
            self._doing[number] = item[0], time.monotonic()
            item[1]()
            self._doing[number] = None
