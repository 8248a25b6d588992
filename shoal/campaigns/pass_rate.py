"""Confidence interval of a pass rate."""

import math
from dataclasses import dataclass
from statistics import NormalDist

INTERVAL_SAMPLINGS = ("random", "latin hypercube")
"""Samplings of which an interval for independent draws is right, or too wide (A. B. Owen, 1997, for the latter).

The points of `sobol` and the blocks of `saltelli` depend on each other, and those of `grid` are not drawn.
"""


def has_interval(sampling: str) -> bool:
    """Whether intervals for independent runs apply to those of a sampling."""
    return sampling in INTERVAL_SAMPLINGS


@dataclass(frozen=True)
class PassRate:
    """Number of `runs` that passed, and the interval that holds the true rate with a confidence.

    `runs` are those whose outcome is known; `unknown` is how many others there are. The interval is Wilson's score
    interval (E. B. Wilson, 1927): right also near 0 and 1 and for few runs, where that of the normal distribution is
    not. It is for independent runs; both ends are NaN if those of the `sampling` are not.
    """

    passed: int
    runs: int
    confidence: float = 0.95
    unknown: int = 0
    sampling: str = "random"

    @property
    def ratio(self) -> float:
        return self.passed / self.runs if self.runs else math.nan

    @property
    def has_interval(self) -> bool:
        return has_interval(self.sampling)

    @property
    def interval(self) -> tuple[float, float]:
        if not self.has_interval:
            return math.nan, math.nan
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
    def width(self) -> float:
        """Width of the interval."""
        low, high = self.interval
        return high - low

    @property
    def ratio_text(self) -> str:
        return f"{self.ratio:.1%}" if self.runs else "unknown"

    @property
    def interval_text(self) -> str:
        """Text of both ends; empty without an interval."""
        low, high = self.interval
        return f"{low:.1%} to {high:.1%}" if self.has_interval else ""

    def __str__(self) -> str:
        others = f"; the outcome of {self.unknown} more is unknown" if self.unknown else ""
        if not self.runs:
            return f"no run yet{others}"
        known = f"{self.interval_text} with {100 * self.confidence:g}% confidence, Wilson"
        if not self.has_interval:
            known = f"no interval: the runs of sampling {self.sampling} are not independent"
        return f"{self.passed} of {self.runs} passed: {self.ratio_text} ({known}){others}"


@dataclass(frozen=True)
class StoppingRule:
    """End of a campaign: after `max_runs`, or sooner when the interval of the pass rate is at most `target_width`
    wide."""

    max_runs: int
    target_width: float | None = None
    confidence: float = 0.95

    def is_reached(self, passed: int, runs: int, unknown: int = 0) -> bool:
        """Whether the first runs are enough: `runs` of which `passed` passed, and those whose outcome is `unknown`."""
        if runs + unknown >= self.max_runs:
            return True
        return (
            self.target_width is not None
            and runs > 0
            and PassRate(passed, runs, self.confidence).width <= self.target_width
        )
