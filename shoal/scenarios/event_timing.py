"""Timing of events in a run: at a time, when a condition begins to hold, once or several times."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from shoal.scenarios.conditions import read_condition
from shoal.scenarios.message_names import ExpressionScope
from shoal.scenarios.run_context import RunContext
from shoal.scenarios.scenario_condition import ScenarioCondition
from shoal.scenarios.value_reader import read_seconds, read_whole_number
from support.located_yaml import Node

TIMING_KEYS = ("at", "when", "after", "every", "times")
SHORTEST_PERIOD = 0.01  # s
UNLIMITED = "unlimited"


@dataclass(frozen=True, eq=False)
class EventTiming:
    """The time `at` (s from the start), or `after` so many seconds when a condition begins to hold.

    At most `times`: each `period` seconds from `at` on, or each time that the condition begins to hold. `where` is its
    place in the file.
    """

    where: str
    at: float = 0.0
    when: ScenarioCondition | None = None
    after: float = 0.0
    period: float = math.inf
    times: float = 1

    def schedule(self, context: RunContext, happen: Callable[[], object]) -> None:
        """Call `happen` at the times of one run. Raises ValueError if a vehicle lacks an entity that is named."""
        run = _TimingInRun(self, context, happen)
        if self.when is not None:
            context.pending_events[self] = f"{self.where}: has not happened: {self.when.text} did not hold"
            context.call_when(self.when, lambda: run.wait_until(context.time + self.after), self.times)
        else:
            run.wait_until(self.at)


class _TimingInRun:
    """Count of an occurrence in one run."""

    def __init__(self, timing: EventTiming, context: RunContext, happen: Callable[[], object]):
        self._timing = timing
        self._context = context
        self._happen = happen
        self._count = 0

    def wait_until(self, time: float) -> None:
        words = f"the run ended before {time:g} s"
        self._context.pending_events[self._timing] = f"{self._timing.where}: {self._progress}: {words}"
        self._context.call_at(time, self._begin)

    def _begin(self) -> None:
        timing, pending = self._timing, self._context.pending_events
        self._count += 1
        pending.pop(timing, None)
        self._happen()
        if self._count >= timing.times:
            return
        if math.isfinite(timing.period):
            self._wait_for_next()
        elif math.isfinite(timing.times) and timing.when is not None:
            pending[timing] = f"{timing.where}: {self._progress}: {timing.when.text} did not begin to hold again"

    def _wait_for_next(self) -> None:
        timing = self._timing
        time = timing.at + self._count * timing.period
        if math.isfinite(timing.times):
            self.wait_until(time)
        else:
            self._context.call_at(time, self._begin)

    @property
    def _progress(self) -> str:
        return f"has happened {self._count} of {self._timing.times} times" if self._count else "has not happened"


def read_timing(node: Node, parts: Mapping[str, Node], scope: ExpressionScope, limit: float) -> EventTiming:
    """The timing of an event; none may be later than `limit` (s). Raises the error of the file."""
    if ("at" in parts) == ("when" in parts):
        node.fail("an event has either a time, at: 60 s, or a condition, when: EstimatedState.depth > 3")
    for key, needed in (("after", "when"), ("every", "at")):
        if key in parts and needed not in parts:
            words = "the time from a condition" if key == "after" else "the period from a time on"
            parts[key].fail(f"{key} is {words}: it needs {needed}")
    at = read_seconds(parts["at"]) if "at" in parts else 0.0
    if at >= limit:
        parts["at"].fail(f"at: {at:g} s is not before the end of the run, at {limit:g} s")
    period = read_seconds(parts["every"]) if "every" in parts else math.inf
    if period < SHORTEST_PERIOD:
        parts["every"].fail(f"every must be at least {SHORTEST_PERIOD:g} s")
    if "times" in parts and "at" in parts and "every" not in parts:
        parts["times"].fail("times needs every: TIME, or a condition: when")
    times = _times(parts["times"]) if "times" in parts else math.inf if "every" in parts else 1
    if math.isfinite(period) and math.isfinite(times) and (last := at + (times - 1) * period) >= limit:
        parts["times"].fail(f"the last time, at {last:g} s, is not before the end of the run, at {limit:g} s")
    return EventTiming(
        node.where,
        at,
        read_condition(parts["when"], scope) if "when" in parts else None,
        read_seconds(parts["after"]) if "after" in parts else 0.0,
        period,
        times,
    )


def _times(node: Node) -> float:
    if node.content == UNLIMITED:
        return math.inf
    if not isinstance(node.value(), int | float):
        node.fail(f"expected a whole number, or {UNLIMITED}, not {node.content!r}")
    times = read_whole_number(node)
    if times < 1:
        node.fail("times must be at least 1")
    return times
