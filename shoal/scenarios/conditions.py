"""Conditions on messages, and expressions of their fields: the grammar of plans, with sums, units and names."""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import imc
from autonomy.plans import COMPARISONS, SIGN_PATTERN, GrammarParser
from autonomy.plans.yaml import UNITS
from shoal.scenarios.operands import MessageSelector, Operand, OperandParser
from shoal.scenarios.robustness import (
    CONNECTIVES,
    LatestMessages,
    RobustnessFunction,
    boolean_robustness,
    comparison_robustness,
)
from support.located_yaml import Node
from support.terminal_text import with_suggestion

T = TypeVar("T", "ScenarioCondition", "MessageExpression")
_UNIT = "|".join(map(re.escape, sorted(UNITS, key=len, reverse=True)))
_NUMBER = r"(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_NAME = r"[A-Za-z_]\w*(?:\[[^\]]*\])?(?:\.\w+)?(?:@\w+(?:[-.]\w+)*)?"
_TEXT = r"\"[^\"]*\"|'[^']*'"
_WORD = re.compile(rf"\s*(?:{_NUMBER}(?:\s*(?:{_UNIT})(?!\w))?|{_NAME}|{_TEXT}|{SIGN_PATTERN}|[-+*/])")
_WAYS = {"<": 1.0, "<=": 1.0, ">": -1.0, ">=": -1.0}
_PLANS = ("true", "maneuverisdone", "maneuverisdone()")


@dataclass(frozen=True)
class ExpressionScope:
    """The vehicles whose messages a text may name, with their schemas; `vehicle` is meant if it names none."""

    vehicles: Mapping[str, imc.Schema]
    vehicle: str = ""


@dataclass(frozen=True, eq=False)
class ScenarioCondition:
    """A condition. `margin(latest)` takes the latest message of each of its `selectors`, None if there is none yet.

    The margin is positive if the condition holds, with any distance left, and NaN as long as messages are missing that
    decide it. For `holds`, a comparison with a message that is missing is false, as in plans.
    """

    text: str
    selectors: tuple[MessageSelector, ...]
    test: RobustnessFunction

    def margin(self, latest: LatestMessages) -> float:
        return self.test(latest, math.nan)

    def holds(self, latest: LatestMessages) -> bool:
        return self.test(latest, -math.inf) > 0.0


class MessageExpression(NamedTuple):
    """A number that follows from messages. `value` takes the latest one of each selector; none may be missing."""

    text: str
    selectors: tuple[MessageSelector, ...]
    value: Callable[[LatestMessages], float]
    unit: str
    is_enumeration: bool = False


def parse_scenario_condition(text: str, scope: ExpressionScope) -> ScenarioCondition:
    """Parse a condition. Raises ValueError with the reason."""
    operands = OperandParser(scope.vehicles, scope.vehicle)

    def single(logic: GrammarParser[RobustnessFunction]) -> RobustnessFunction:
        if logic.lookahead_word is not None and logic.lookahead_word.lower() in _PLANS:
            raise ValueError(
                f"{logic.lookahead_word!r} is for plans only: compare PlanControlState.man_id or .state instead"
            )
        return _comparison(operands, logic)

    test = GrammarParser[RobustnessFunction](text, _WORD, single, CONNECTIVES, sums=True).parse()
    return ScenarioCondition(text, tuple(operands.selectors), test)


def parse_expression(text: str, scope: ExpressionScope) -> MessageExpression:
    """Parse an expression. Raises ValueError with the reason."""
    operands = OperandParser(scope.vehicles, scope.vehicle)
    logic = GrammarParser[RobustnessFunction](
        text, _WORD, lambda logic: _comparison(operands, logic), CONNECTIVES, sums=True
    )
    operand = operands.parse_sum(logic)
    logic.expect_end()
    operand.check_is_number()
    return MessageExpression(text, tuple(operands.selectors), operand.value, operand.unit, operand.enum is not None)


def read_condition(node: Node, scope: ExpressionScope) -> ScenarioCondition:
    """The condition in a file. Raises the error of the file, which names the line."""
    return _read(node, scope, parse_scenario_condition)


def read_expression(node: Node, scope: ExpressionScope) -> MessageExpression:
    """The expression in a file. Raises the error of the file, which names the line."""
    return _read(node, scope, parse_expression)


def _read(node: Node, scope: ExpressionScope, parse: Callable[[str, ExpressionScope], T]) -> T:
    text = node.text()
    try:
        found = parse(text, scope)
    except ValueError as error:
        node.fail(f"{text}: {error}")
    if not found.selectors:
        node.fail(f"{text}: names no message, so nothing can change it")
    return found


def _comparison(operands: OperandParser, logic: GrammarParser[RobustnessFunction]) -> RobustnessFunction:
    left = operands.parse_sum(logic)
    sign = logic.lookahead_word
    compare = logic.expect_comparison()
    right = operands.parse_sum(logic)
    if logic.lookahead_word in COMPARISONS:
        raise ValueError(f"{logic.lookahead_word!r} is not expected: join two comparisons by and")
    left, right = _named(left, right), _named(right, left)
    is_text = left.is_text or right.is_text
    if is_text and not (left.is_text and right.is_text and sign in ("==", "!=")):
        raise ValueError("a text can only be compared with a text, by == or !=")
    if not is_text:
        left.check_units(right)
    measure = (
        boolean_robustness if is_text or left.enum is not None or right.enum is not None else comparison_robustness
    )
    a, b, needs = left.value, right.value, tuple(sorted(left.needs | right.needs))
    if len(needs) == 1:
        (only,) = needs
        if measure is comparison_robustness and not right.needs and sign in _WAYS:
            return _bound(only, a, _WAYS[sign], b(()), compare)
        return lambda latest, unknown: unknown if latest[only] is None else measure(compare, a(latest), b(latest))

    def test(latest: LatestMessages, unknown: float) -> float:
        for index in needs:
            if latest[index] is None:
                return unknown
        return measure(compare, a(latest), b(latest))

    return test


def _bound(
    only: int, a: Callable[[LatestMessages], float], way: float, limit: float, compare: Callable[[float, float], bool]
) -> RobustnessFunction:
    """A comparison with a constant, which is by far the most frequent one."""

    def test(latest: LatestMessages, unknown: float) -> float:
        if latest[only] is None:
            return unknown
        value = a(latest)
        margin = way * (limit - value)
        return (
            margin
            if 0.0 < margin < math.inf or -math.inf < margin < 0.0
            else comparison_robustness(compare, value, limit)
        )

    return test


def _named(operand: Operand, other: Operand) -> Operand:
    """A name as the value that the enumeration of the other side gives it."""
    if not operand.name:
        return operand
    if other.enum is None:
        raise ValueError(
            with_suggestion(f"{operand.name!r} is neither a number nor Message.field", operand.name, operand.known)
        )
    if operand.name not in other.enum.__members__:
        names = list(other.enum.__members__)
        raise ValueError(with_suggestion(f"{operand.name!r} is not a value of {other.text}", operand.name, names))
    number = float(other.enum[operand.name])
    return Operand(operand.name, lambda _: number, enum=other.enum)
