"""Values that a run captures at an event, a time or a condition, for conditions and expressions to use later."""

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace

from shoal.scenarios.conditions import read_expression
from shoal.scenarios.event_timing import TIMING_KEYS, EventTiming, read_timing
from shoal.scenarios.message_names import ExpressionScope
from shoal.scenarios.run_context import RunContext
from shoal.scenarios.scenario import ScenarioFileError
from shoal.scenarios.scenario_condition import MessageExpression
from shoal.scenarios.value_reader import read_choice, read_mapping
from support.located_yaml import Node


@dataclass(frozen=True, eq=False)
class Capture:
    """The value of an expression at its times, or just before the event with a name. The latest one counts."""

    name: str
    where: str
    expression: MessageExpression
    timing: EventTiming | None = None
    event: str = ""

    def schedule(self, context: RunContext) -> None:
        """Prepare it, before the vehicles start. Raises ScenarioFileError if a vehicle lacks an entity."""
        captured = context.monitor.captured_value(self.name)
        expression = self.expression
        missed = f"{self.where}: ${self.name} was not captured: {expression.text} had no value"
        try:
            (latest,) = context.monitor.add_subscriber([expression.selectors], lambda _: None)

            def capture() -> None:
                if expression.is_known(latest):
                    captured.capture(expression.value(latest), context.time)
                elif missed not in context.warnings:
                    context.warnings.append(missed)

            if self.timing is not None:
                self.timing.schedule(context, capture)
            else:
                context.event_watchers.setdefault(self.event, []).append(capture)
        except ValueError as error:
            raise ScenarioFileError(str(error), self.where) from None


def read_captures(
    node: Node, scopes: Mapping[str, ExpressionScope], events: Collection[str], limit: float = math.inf
) -> tuple[tuple[Capture, ...], dict[str, str]]:
    """The captures in a file, and the units of their values by name.

    `scopes` are by name of the vehicle that is meant; the empty name is for none. Raises the error of the file.
    """
    units: dict[str, str] = {}
    return tuple(_captures(node, scopes, events, limit, units)), units


def _captures(
    node: Node,
    scopes: Mapping[str, ExpressionScope],
    events: Collection[str],
    limit: float,
    units: dict[str, str],
) -> Iterator[Capture]:
    for name, item in node.mapping().items():
        if not name.isidentifier():
            item.fail(f"{name!r} cannot be a name: it stands behind $, so letters, digits and _ are allowed")
        parts = read_mapping(item, "of", "event", "vehicle", *TIMING_KEYS)
        if "of" not in parts:
            item.fail("'of' is missing: what is captured, such as of: EstimatedState.depth")
        vehicle = read_choice(parts["vehicle"], [key for key in scopes if key], "vehicle") if "vehicle" in parts else ""
        scope = replace(scopes[vehicle], captures=dict(units))
        expression = read_expression(parts["of"], scope)
        if "event" in parts:
            if more := [key for key in TIMING_KEYS if key in parts]:
                parts[more[0]].fail(f"the time is that of the event: no {more[0]}")
            if not events:
                parts["event"].fail("no event has a name: write name: NAME in one")
            event = read_choice(parts["event"], events, "event with the name")
            found = Capture(name, item.where, expression, event=event)
        else:
            found = Capture(name, item.where, expression, read_timing(item, parts, scope, limit))
        units[name] = expression.unit
        yield found
