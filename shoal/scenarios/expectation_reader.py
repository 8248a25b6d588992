"""Reads what a scenario expects and measures."""

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass

from imc.expressions import negate_unless_nan
from shoal.missions import COMPLETED, FAILED, LATE
from shoal.scenarios.conditions import read_condition, read_expression
from shoal.scenarios.expectations import METRIC_BOUNDS, Expectation
from shoal.scenarios.message_names import ExpressionScope
from shoal.scenarios.metrics import KINDS_OF_ENUMERATIONS, METRIC_KINDS, Metric
from shoal.scenarios.scenario_condition import ScenarioCondition
from shoal.scenarios.value_reader import read_choice, read_mapping, read_nonempty_text, read_number, read_seconds
from support.located_yaml import Node
from support.terminal_text import with_suggestion

TIMES = ("from", "to", "while", "vehicle", "name")
EXPECTED: Mapping[str, tuple[str, ...]] = {  # further keys of each kind; the first kind found counts
    "metric": (*METRIC_BOUNDS, "name"),
    "after": ("within", "eventually", "always", "never", *TIMES),
    "until": ("holds", "within", *TIMES),
    "always": TIMES,
    "never": TIMES,
    "eventually": ("within", *TIMES),
    "finally": ("vehicle", "name"),
    "outcome": ("vehicle", "name"),
}
OUTCOMES = (COMPLETED, FAILED, LATE)


@dataclass(frozen=True)
class ExpectationReader:
    """Reads with `scope_of` a node that names a vehicle, or None; `planned` are the vehicles with a plan.

    What is wrong is an error of the file.
    """

    scope_of: Callable[[Node | None], ExpressionScope]
    planned: Collection[str]

    def expectations(self, node: Node, units: Mapping[str, str]) -> Iterator[Expectation]:
        """The expectations; `units` are those of all metrics by name."""
        taken: set[str] = set()
        for item in node.items():
            found = self._expectation(item, units)
            if found.name in taken:
                item.fail(f"the name {found.name!r} is used twice: give each a name of its own")
            taken.add(found.name)
            yield found

    def metrics(self, node: Node, taken: Collection[str]) -> Iterator[Metric]:
        """The metrics; `taken` are the names of counts of links."""
        for name, item in node.mapping().items():
            if name in taken:
                item.fail(f"{name!r} is a count of a link already")
            yield self._metric(name, item)

    def _expectation(self, node: Node, units: Mapping[str, str]) -> Expectation:
        given = node.mapping()
        kind = next((kind for kind in EXPECTED if kind in given), "")
        if not kind:
            wrong = next((key for key in given if key not in TIMES), "")
            node.fail(
                with_suggestion(f"expected one of {', '.join(EXPECTED)}", wrong, EXPECTED) if wrong else "says nothing"
            )
        parts = read_mapping(node, kind, *EXPECTED[kind])
        name = read_nonempty_text(parts["name"]) if "name" in parts else ""
        if kind == "metric":
            return _metric_limit(node, name, parts, units)
        scope = self.scope_of(parts.get("vehicle"))
        name = name or f"{kind} {parts[kind].text()}"
        if kind == "outcome":
            return self._outcome(node, name, scope)
        condition = read_condition(parts[kind], scope)
        then, steady = _then(node, kind, scope)
        begin, end = _span(parts)
        return Expectation(
            name,
            kind,
            node.where,
            _negated_condition(condition) if kind == "never" else condition,
            then,
            read_condition(parts["while"], scope) if "while" in parts else None,
            begin,
            end,
            read_seconds(parts["within"]) if "within" in parts else math.inf,
            steady,
            vehicle=scope.vehicle,
        )

    def _outcome(self, node: Node, name: str, scope: ExpressionScope) -> Expectation:
        parts = node.mapping()
        wanted = read_choice(parts["outcome"], OUTCOMES, "outcome")
        if not scope.vehicle:
            parts["outcome"].fail("there are several vehicles: write vehicle: NAME")
        if scope.vehicle not in self.planned:
            parts["outcome"].fail(f"{scope.vehicle} has no plan")
        return Expectation(name, "outcome", node.where, wanted=wanted, vehicle=scope.vehicle)

    def _metric(self, name: str, node: Node) -> Metric:
        given = node.mapping()
        kind = next((kind for kind in METRIC_KINDS if kind in given), "")
        if not kind:
            wrong = next(iter(given), "")
            node.fail(with_suggestion(f"expected one of {', '.join(METRIC_KINDS)}", wrong, METRIC_KINDS))
        needed = {"percentile": "of", "time above": "limit", "time below": "limit"}.get(kind, "")
        parts = read_mapping(node, kind, *([needed] if needed else []), "from", "to", "while", "vehicle")
        scope = self.scope_of(parts.get("vehicle"))
        expression = read_expression(parts[kind], scope)
        if expression.is_enumeration and kind not in KINDS_OF_ENUMERATIONS:
            allowed = " or ".join(KINDS_OF_ENUMERATIONS)
            parts[kind].fail(
                f"{expression.text} is an enumeration, whose numbers have no {kind}: "
                f"{allowed} of it, or an expectation such as always"
            )
        bound = math.nan
        if needed:
            if needed not in parts:
                node.fail(f"{needed!r} is missing")
            bound = read_number(parts[needed], expression.unit if needed == "limit" else "%")
            if needed == "of" and not 0.0 <= bound <= 100.0:
                parts["of"].fail("a percentage is from 0 to 100")
        meanwhile = read_condition(parts["while"], scope) if "while" in parts else None
        return Metric(name, kind, node.where, expression, meanwhile, *_span(parts), bound)


def _metric_limit(node: Node, name: str, parts: Mapping[str, Node], units: Mapping[str, str]) -> Expectation:
    if not units:
        parts["metric"].fail("the scenario has no metrics")
    metric = read_choice(parts["metric"], units, "metric")
    given = [key for key in METRIC_BOUNDS if key in parts]
    if not given:
        node.fail(f"a limit is missing: one of {', '.join(METRIC_BOUNDS)}")
    bounds = {key: read_number(parts[key], units[metric]) for key in given}
    words = ", ".join(f"{key} {parts[key].text()}" for key in given)
    return Expectation(name or f"{metric} {words}", "metric", node.where, metric=metric, bounds=bounds)


def _then(node: Node, kind: str, scope: ExpressionScope) -> tuple[ScenarioCondition | None, bool]:
    """Expression that must hold until a condition does, or after it; and whether it must hold all the time."""
    parts = node.mapping()
    if kind == "until":
        if "holds" not in parts:
            node.fail("'holds' is missing: what has to hold until then")
        return read_condition(parts["holds"], scope), False
    if kind != "after":
        return None, False
    ways = [key for key in ("eventually", "always", "never") if key in parts]
    if len(ways) != 1 or "within" not in parts:
        node.fail("after needs within: TIME, and one of eventually, always or never: what has to follow")
    found = read_condition(parts[ways[0]], scope)
    return (_negated_condition(found) if ways[0] == "never" else found), ways[0] != "eventually"


def _span(parts: Mapping[str, Node]) -> tuple[float, float]:
    """Begin and end (s) of what is judged or measured."""
    begin, end = (
        read_seconds(parts[key]) if key in parts else usual for key, usual in (("from", 0.0), ("to", math.inf))
    )
    if end < begin:
        parts["to"].fail("ends before it begins")
    return begin, end


def _negated_condition(condition: ScenarioCondition) -> ScenarioCondition:
    """The condition that holds when another one does not."""
    return ScenarioCondition(f"not ({condition.text})", condition.selectors, negate_unless_nan(condition.test))
