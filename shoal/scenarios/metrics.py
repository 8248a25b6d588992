"""Metrics of a run: numbers that follow from all values of an expression."""

import math
from array import array
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from shoal.scenarios.message_monitor import missing_text
from shoal.scenarios.run_context import RunContext
from shoal.scenarios.scenario_condition import MessageExpression, ScenarioCondition, depends_on_time

METRIC_KINDS = ("max", "min", "mean", "rms", "first", "last", "percentile", "time above", "time below")
KINDS_OF_ENUMERATIONS = ("first", "last")


@dataclass(frozen=True, eq=False)
class Metric:
    """A number of a run: `kind` of the values of an expression from `begin` to `end` (s), while a condition holds.

    `bound` is the limit of a time above or below it, or the percentage of a percentile.
    """

    name: str
    kind: str
    origin: str
    expression: MessageExpression
    meanwhile: ScenarioCondition | None = None
    begin: float = 0.0
    end: float = math.inf
    bound: float = math.nan

    @property
    def unit(self) -> str:
        """The unit of its value; empty if it is not known."""
        return "s" if self.kind.startswith("time") else self.expression.unit

    def make_recorder(self, context: RunContext) -> "MetricRecorder":
        """Make the recorder of one run. Raises ValueError if a vehicle lacks an entity that is named."""
        return MetricRecorder(self, context)


class MetricRecorder:
    """Takes the value of an expression at each message that it watches."""

    transient = True

    def __init__(self, metric: Metric, context: RunContext):
        self.metric = metric
        self._context = context
        groups = [metric.expression.selectors, *([metric.meanwhile.selectors] if metric.meanwhile is not None else [])]
        self._samples = array("d")
        self._undefined = 0
        self._duration = 0.0
        self._since = math.nan  # when it went beyond the limit
        self._keep = self._keepers().get(metric.kind, self._samples.append)
        self._needs_all, self._is_known = metric.expression.needs_all, metric.expression.is_known
        self._value, self._is_timed = metric.expression.value, metric.kind.startswith("time")
        self._is_free = metric.begin == 0.0 and metric.end == math.inf and metric.meanwhile is None
        self._latest = context.monitor.add_subscriber(groups, self.update)

    def update(self, now: float) -> None:
        """Take the value of the latest messages."""
        known = None not in self._latest[0] if self._needs_all else self._is_known(self._latest[0])
        if not known or not (self._is_free or self._applies(now)):
            if self._is_timed:
                self._mark(now, beyond=False)
            return
        value = self._value(self._latest[0])
        if value != value:
            self._undefined += 1
        elif self._samples:
            self._keep(value)
        else:
            self._samples.append(value)
        if self._is_timed:
            bound = self.metric.bound
            self._mark(now, beyond=value > bound if self.metric.kind == "time above" else value < bound)

    def finish(self) -> None:
        """Take the value of what changes without messages once more, at the end of the run."""
        if any(map(depends_on_time, self.metric.expression.selectors)):
            self.update(self._context.time)

    def _applies(self, now: float) -> bool:
        metric = self.metric
        if not metric.begin <= now <= metric.end:
            return False
        return metric.meanwhile is None or metric.meanwhile.holds(self._latest[1])

    def _keepers(self) -> dict[str, Callable[[float], object]]:
        """Functions for each value after the first one; by default the value is kept."""
        samples = self._samples

        def larger(value: float) -> None:
            if value > samples[0]:
                samples[0] = value

        def smaller(value: float) -> None:
            if value < samples[0]:
                samples[0] = value

        def latest(value: float) -> None:
            samples[0] = value

        def nothing(value: float) -> None:
            pass

        first = dict.fromkeys(("first", "time above", "time below"), nothing)
        return {"max": larger, "min": smaller, "last": latest, **first}

    def _mark(self, now: float, *, beyond: bool) -> None:
        now = min(now, self.metric.end)
        if self._since == self._since:
            self._duration += now - self._since
        self._since = now if beyond else math.nan

    def value(self) -> float:
        """The result at the end of the run; NaN if there was nothing to measure, or a value was no number."""
        samples, kind = self._samples, self.metric.kind
        if not samples or self._undefined:
            return math.nan
        if kind == "mean":
            return _mean(samples)
        if kind == "rms":
            return math.sqrt(_mean(x * x for x in samples))
        if kind == "percentile":
            return _percentile(samples, self.metric.bound)
        if kind in ("time above", "time below"):
            self._mark(self._context.time, beyond=False)
            return self._duration
        return samples[0]

    def warning(self) -> str:
        """Reason why there is no value, for people; else empty."""
        if self._undefined:
            return (
                f"metric {self.metric.name}: {self._undefined} values of {self.metric.expression.text} are no numbers"
            )
        if self._samples and math.isnan(self.value()):
            return f"metric {self.metric.name}: values of {self.metric.expression.text} are too large for a mean"
        if not self._samples:
            missing = missing_text([self.metric.expression.selectors], self._latest[:1])
            why = missing or "there was never anything to measure"
            return f"metric {self.metric.name}: {why}"
        return ""


def _mean(values: Iterable[float]) -> float:
    """The mean; NaN if the sum is too large for a number, or of both infinities."""
    kept = list(values)
    try:
        return math.fsum(kept) / len(kept)
    except (OverflowError, ValueError):
        return math.nan


def _percentile(samples: "array[float]", percentage: float) -> float:
    """The value below which so many percent of the samples are, between neighbors in proportion."""
    ordered = sorted(samples)
    place = percentage / 100.0 * (len(ordered) - 1)
    low = math.floor(place)
    high = min(low + 1, len(ordered) - 1)
    if not math.isfinite(ordered[low]) or not math.isfinite(ordered[high]):
        return ordered[low] if place == low else ordered[high]
    return ordered[low] + (place - low) * (ordered[high] - ordered[low])
