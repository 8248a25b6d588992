"""How well a pass rate is known."""

import math
from dataclasses import dataclass
from statistics import NormalDist


@dataclass(frozen=True)
class PassRate:
    """How many of `runs` passed, and the interval that holds the true rate with a confidence.

    The interval is Wilson's score interval (E. B. Wilson, 1927): right also near 0 and 1 and for few runs, where
    that of the normal distribution is not.
    """

    passed: int
    runs: int
    confidence: float = 0.95

    @property
    def ratio(self) -> float:
        return self.passed / self.runs if self.runs else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        if not self.runs:
            return 0.0, 1.0
        z = NormalDist().inv_cdf(0.5 + 0.5 * self.confidence)
        spread = 1.0 + z * z / self.runs
        middle = (self.ratio + 0.5 * z * z / self.runs) / spread
        half = z / spread * math.sqrt(self.ratio * (1.0 - self.ratio) / self.runs + 0.25 * (z / self.runs) ** 2)
        low = 0.0 if self.passed == 0 else max(middle - half, 0.0)
        high = 1.0 if self.passed == self.runs else min(middle + half, 1.0)
        return low, high

    @property
    def half_width(self) -> float:
        low, high = self.interval
        return 0.5 * (high - low)

    def __str__(self) -> str:
        low, high = self.interval
        if not self.runs:
            return "no run yet"
        known = f"{low:.1%} to {high:.1%} with {100 * self.confidence:g}% confidence, Wilson"
        return f"{self.passed} of {self.runs} passed: {self.ratio:.1%} ({known})"


@dataclass(frozen=True)
class StoppingRule:
    """When a campaign ends: after `max_runs`, or sooner when the pass rate is known to ± `target_half_width`."""

    max_runs: int
    target_half_width: float | None = None
    confidence: float = 0.95

    def is_reached(self, passed: int, runs: int) -> bool:
        """Whether the first `runs` runs, of which `passed` passed, are enough."""
        if runs >= self.max_runs:
            return True
        return (
            self.target_half_width is not None
            and runs > 0
            and PassRate(passed, runs, self.confidence).half_width <= self.target_half_width
        )
