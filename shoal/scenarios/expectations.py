"""Expectations of a run: how they are judged, each with its margin."""

import math
import operator
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

from imc.expressions import RobustnessFunction, comparison_robustness, displayable_margin, is_unknown, violation_text
from shoal.scenarios.message_monitor import MessageSlots, missing_text
from shoal.scenarios.result import ExpectationVerdict
from shoal.scenarios.run_context import RunContext
from shoal.scenarios.scenario_condition import ScenarioCondition, depends_on_time

METRIC_BOUNDS: Mapping[str, Callable[[float, float], bool]] = MappingProxyType(
    {"at most": operator.le, "below": operator.lt, "at least": operator.ge, "above": operator.gt}
)
"""Limits of a metric."""


@dataclass(frozen=True, eq=False)
class Expectation:
    """Expectation of a run: `kind` is always, never, eventually, until, after, finally, outcome or metric.

    `condition` is judged from `begin` to `end` (s), while `meanwhile` holds. `then` is what has to hold until the
    condition does, or what must follow it: at all, or always if `steady`, `within` so many seconds. `wanted` is the
    outcome of the plan of `vehicle`, `bounds` are those of a `metric`.
    """

    name: str
    kind: str
    origin: str
    condition: ScenarioCondition | None = None
    then: ScenarioCondition | None = None
    meanwhile: ScenarioCondition | None = None
    begin: float = 0.0
    end: float = math.inf
    within: float = math.inf
    steady: bool = False
    wanted: str = ""
    vehicle: str = ""
    metric: str = ""
    bounds: Mapping[str, float] = field(default_factory=dict[str, float])

    def judge_metric(self, value: float, time: float) -> ExpectationVerdict:
        """The verdict of a metric with this value, at the end of the run (s)."""
        margins = [comparison_robustness(METRIC_BOUNDS[key], value, bound) for key, bound in self.bounds.items()]
        margin = min(margins)
        reason = f"{self.metric} is {value:.6g}" if value == value else f"{self.metric} was not measured"
        reason += violation_text(margin, "off by") if value == value else ""
        passed, shown = margin > 0.0, displayable_margin(margin)
        return ExpectationVerdict(self.name, passed, shown, reason, value == value, time, self.origin)

    def make_monitor(self, context: RunContext) -> "ExpectationMonitor":
        """Make the monitor that judges one run. Raises ValueError if a vehicle lacks an entity that is named."""
        kinds = {
            "eventually": EventuallyMonitor,
            "until": UntilMonitor,
            "after": ResponseMonitor,
            "finally": FinallyMonitor,
        }
        return kinds.get(self.kind, AlwaysMonitor)(self, context)


class ExpectationMonitor(ABC):
    """Judges an expectation at each message that it watches; `verdict` is its result at the end."""

    transient = True

    def __init__(self, expected: Expectation, context: RunContext):
        self.expected = expected
        self._context = context
        conditions = [c for c in (expected.condition, expected.then, expected.meanwhile) if c is not None]
        self._selectors = [condition.selectors for condition in conditions]
        tests = [c.test for c in (expected.condition, expected.then) if c is not None]
        self.test: RobustnessFunction = tests[0]
        self.then_test: RobustnessFunction = tests[-1]
        is_free = expected.begin == 0.0 and expected.end == math.inf and expected.meanwhile is None
        self._latest = context.monitor.add_subscriber(self._selectors, self.update_margin if is_free else self._update)
        self.latest: MessageSlots = self._latest[0]
        self.then_latest: MessageSlots = self._latest[len(tests) - 1]
        self.count = 0

    def _update(self, now: float) -> None:
        """Judge the latest messages, if it is time for that."""
        expected = self.expected
        if not expected.begin <= now <= expected.end:
            return
        if expected.meanwhile is not None and not expected.meanwhile.holds(self._latest[-1]):
            return
        self.update_margin(now)

    def finish(self) -> None:
        """Judge what changes without messages once more, at the end of the run."""
        if any(depends_on_time(selector) for group in self._selectors for selector in group):
            self._update(self._context.time)

    @abstractmethod
    def update_margin(self, now: float) -> None:
        """Judge at a time at which the expectation applies."""

    @abstractmethod
    def verdict(self) -> ExpectationVerdict:
        """The verdict, at the end of the run."""

    def make_verdict(self, margin: float, reason: str, time: float, *, applied: bool = True) -> ExpectationVerdict:
        passed = margin > 0.0
        return ExpectationVerdict(
            self.expected.name,
            passed,
            displayable_margin(margin),
            reason,
            applied,
            time,
            self.expected.origin,
        )

    def vacuous_verdict(self, *, passed: bool) -> ExpectationVerdict:
        """The verdict of what never had anything to judge."""
        reason = missing_text(self._selectors, self._latest) or "there was never anything to judge"
        return self.make_verdict(math.inf if passed else -math.inf, reason, math.nan, applied=False)


class AlwaysMonitor(ExpectationMonitor):
    """The condition holds at all times; its margin is the smallest.

    A sample without its message counts neither way; a value that is not a number fails.
    """

    least: float = math.inf
    time: float = math.nan
    failed_at: float = math.nan

    def update_margin(self, now: float) -> None:
        margin = self.test(self.latest, math.nan)
        if is_unknown(margin):
            return
        self.count += 1
        if margin < self.least or self.count == 1:
            self.least, self.time = margin, now
        if margin <= 0.0 and self.failed_at != self.failed_at:
            self.failed_at = now

    def verdict(self) -> ExpectationVerdict:
        if not self.count:
            return self.vacuous_verdict(passed=True)
        if self.least > 0.0:
            return self.make_verdict(self.least, f"closest at {self.time:.3f} s", self.time)
        worst = violation_text(self.least, f"worst at {self.time:.3f} s, by")
        return self.make_verdict(self.least, f"failed first at {self.failed_at:.3f} s{worst}", self.time)


class EventuallyMonitor(ExpectationMonitor):
    """The condition holds at one time at least; its margin is the largest."""

    most: float = -math.inf
    time: float = math.nan
    met_at: float = math.nan

    def update_margin(self, now: float) -> None:
        margin = self.test(self.latest, math.nan)
        if is_unknown(margin) or now > self.deadline:
            return
        self.count += 1
        if margin > self.most or self.count == 1:
            self.most, self.time = margin, now
        if margin > 0.0 and self.met_at != self.met_at:
            self.met_at = now

    @property
    def deadline(self) -> float:
        return self.expected.begin + self.expected.within

    def verdict(self) -> ExpectationVerdict:
        if not self.count:
            return self.vacuous_verdict(passed=False)
        if self.most > 0.0:
            return self.make_verdict(self.most, f"met at {self.met_at:.3f} s", self.time)
        when = f"until {min(self.deadline, self.expected.end, self._context.time):.3f} s"
        near = violation_text(self.most, f"closest at {self.time:.3f} s, off by")
        return self.make_verdict(self.most, f"not met {when}{near}", self.time)


class UntilMonitor(ExpectationMonitor):
    """The condition holds at one time, and `then` at all times before it."""

    held: float = math.inf
    broken_at: float = math.nan
    best: float = -math.inf
    time: float = math.nan

    def update_margin(self, now: float) -> None:
        if now > self.expected.begin + self.expected.within:
            return
        margin, holding = self.test(self.latest, math.nan), self.then_test(self.then_latest, math.nan)
        if margin == margin:
            self.count += 1
            if (found := min(margin, self.held)) > self.best:
                self.best, self.time = found, now
        if holding == holding and holding < self.held:
            self.held = holding
            self.broken_at = now if holding <= 0.0 and self.broken_at != self.broken_at else self.broken_at

    def verdict(self) -> ExpectationVerdict:
        if not self.count:
            return self.vacuous_verdict(passed=False)
        if self.best > 0.0:
            return self.make_verdict(self.best, f"met at {self.time:.3f} s", self.time)
        expected = self.expected
        assert expected.condition is not None
        assert expected.then is not None
        if self.held <= 0.0:
            reason = f"{expected.then.text} failed at {self.broken_at:.3f} s, before {expected.condition.text}"
            return self.make_verdict(self.best, reason, self.broken_at)
        end = min(expected.begin + expected.within, expected.end, self._context.time)
        return self.make_verdict(self.best, f"{expected.condition.text} did not hold until {end:.3f} s", self.time)


class ResponseMonitor(ExpectationMonitor):
    """Each time that the condition begins to hold, `then` holds soon, or for a while."""

    def __init__(self, expected: Expectation, context: RunContext):
        super().__init__(expected, context)
        self._held = False
        self._open: list[list[float]] = []  # begin and margin of what is not decided yet
        self._least, self._time = math.inf, math.nan

    def update_margin(self, now: float) -> None:
        self._close(now)
        holds = self.test(self.latest, -math.inf) > 0.0
        if holds and not self._held:
            self._open.append([now, math.nan])
        self._held = holds
        margin = self.then_test(self.then_latest, math.nan)
        choose = min if self.expected.steady else max
        if margin == margin:
            for window in self._open:
                window[1] = choose(window[1], margin) if window[1] == window[1] else margin

    def _close(self, now: float) -> None:
        while self._open and now > self._open[0][0] + self.expected.within:
            self._decide(*self._open.pop(0))

    def _decide(self, begin: float, margin: float) -> None:
        if is_unknown(margin):
            if self.expected.steady:  # nothing was there to judge
                return
            margin = -math.inf
        self.count += 1
        if margin < self._least or self.count == 1:
            self._least, self._time = margin, begin

    def verdict(self) -> ExpectationVerdict:
        end = min(self._context.time, self.expected.end)
        for begin, margin in self._open:
            is_over = end >= begin + self.expected.within
            if is_over or (margin > 0.0) != self.expected.steady:  # what the end leaves open is not judged
                self._decide(begin, margin)
        self._open.clear()
        if not self.count:
            return self.vacuous_verdict(passed=True)
        times = f"{self.count} time{'s' * (self.count > 1)}"
        if self._least > 0.0:
            return self.make_verdict(self._least, f"followed {times}, closest after {self._time:.3f} s", self._time)
        far = violation_text(self._least, "off by")
        return self.make_verdict(self._least, f"did not follow after {self._time:.3f} s{far}", self._time)


class FinallyMonitor(ExpectationMonitor):
    """The condition holds at the end."""

    def update_margin(self, now: float) -> None:
        """Ignore values from before the end."""

    def verdict(self) -> ExpectationVerdict:
        margin = self.test(self.latest, math.nan)
        if is_unknown(margin):
            return self.vacuous_verdict(passed=False)
        far = violation_text(margin, "off by")
        return self.make_verdict(margin, f"at the end, {self._context.time:.3f} s{far}", self._context.time)


def vacuous_warnings(verdicts: Sequence[ExpectationVerdict]) -> list[str]:
    """Warnings of expectations that have passed and proved nothing."""
    return [f"{v.name} proved nothing: {v.reason}" for v in verdicts if v.passed and not v.applied]
