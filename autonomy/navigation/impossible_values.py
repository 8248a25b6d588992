"""Counts of measurements that no sound sensor gives."""

import math
from collections import Counter

PERIOD = 60.0  # s between two reports


class ImpossibleValues:
    """Rejects measurements that are no number or out of their range, counts them by kind, and reports the counts."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self._total = self._reported = 0
        self._report_time = -math.inf

    def accepts(self, kind: str, possible: bool) -> bool:
        """Returns `possible`; counts a measurement of this kind that is not."""
        if not possible:
            self._count(kind)
        return possible

    def accepts_within(self, kind: str, limit: float, *values: float) -> bool:
        """Whether no value exceeds a limit in its amount, in their unit; counts the measurement if one does."""
        for value in values:
            if not abs(value) <= limit:  # NaN, too
                self._count(kind)
                return False
        return True

    def _count(self, kind: str) -> None:
        self.counts[kind] += 1
        self._total += 1

    def report(self, now: float) -> str:
        """Numbers rejected since the start, for people, at a time (s); empty if none is new or one came just now."""
        if self._total == self._reported or now - self._report_time < PERIOD:
            return ""
        self._reported, self._report_time = self._total, now
        kinds = ", ".join(f"{count} of {kind}" for kind, count in sorted(self.counts.items()))
        return f"impossible values are rejected: {kinds}"
