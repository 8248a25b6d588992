"""Counts what goes wrong with packets, and reports it at most once in REPORT_PERIOD."""

import logging
import threading
import time
from collections.abc import Callable

REPORT_PERIOD = 10.0  # s

logger = logging.getLogger("shoal.zenoh")


class FaultCounter:
    """Counts one kind of fault; reports the first one, then at most once in REPORT_PERIOD seconds."""

    def __init__(self, what: str, report: Callable[[str], None] = logger.warning) -> None:
        self.total = 0
        self._what = what
        self._report = report
        self._told = 0
        self._next = 0.0
        self._lock = threading.Lock()

    def count(self, detail: object, number: int = 1) -> None:
        with self._lock:
            self.total += number
            now = time.monotonic()
            if now < self._next:
                return
            self._next = now + REPORT_PERIOD
        self.tell(detail)

    def tell(self, detail: object = "", report: Callable[[str], None] | None = None) -> None:
        """Report what has not been reported yet."""
        if self.total > self._told:
            (report or self._report)(
                f"{self.total - self._told} packets {self._what}" + (f"; {detail}" if detail else "")
            )
            self._told = self.total
