"""Counts what goes wrong with packets, and reports it at most once in REPORT_PERIOD."""

import logging
import threading
import time
from collections.abc import Callable

from support.log_limit import ReportLimit

REPORT_PERIOD = 10.0  # s

logger: logging.Logger = logging.getLogger("shoal.zenoh")


class ErrorCounter:
    """Counts one kind of fault; reports the first one, then at most once in REPORT_PERIOD seconds."""

    def __init__(self, what: str, report: Callable[[str], None] = logger.warning) -> None:
        self.total: int = 0
        self._what = what
        self._report = report
        self._reported = 0
        self._limit, self._last = ReportLimit(REPORT_PERIOD), 0.0
        self._lock = threading.Lock()

    def count(self, detail: object, number: int = 1) -> None:
        with self._lock:
            self.total += number
            self._last = time.monotonic()
            if not self._limit.is_due(now=self._last):
                return
        self.report(detail)

    def report(self, detail: object) -> None:
        """Report what has not been reported yet."""
        if text := self._unreported():
            self._report(f"{text}; {detail}")

    def report_final(self, whose: str, report: Callable[[str], None]) -> None:
        """Report what has not been reported yet, of something that has ended: `whose` these packets were."""
        ago = time.monotonic() - self._last
        if text := self._unreported():
            report(f"{whose}: {text}, the last {ago:.1f} s before the end, beside those in the log book")

    def _unreported(self) -> str:
        number, self._reported = self.total - self._reported, self.total
        return f"{number} packets {self._what}" if number else ""
