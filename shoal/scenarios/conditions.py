"""Conditions on messages, and expressions of their fields: the grammar of plans, with sums, units and names."""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import imc
from autonomy.plans import COMPARISONS, SIGN_PATTERN, GrammarParser
from autonomy.plans.yaml import UNITS
from shoal.scenarios.margins import CONNECTIVES, Latest, Margin, gap, verdict
from shoal.scenarios.operands import Operand, Operands, Watch
from support.located_yaml import Node
from support.text import with_suggestion

T = TypeVar("T", "Condition", "Expression")
_UNIT = "|".join(map(re.escape, sorted(UNITS, key=len, reverse=True)))
_NUMBER = r"(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_NAME = r"[A-Za-z_]\w*(?:\[[^\]]*\])?(?:\.\w+)?(?:@\w+(?:[-.]\w+)*)?"
_TEXT = r"\"[^\"]*\"|'[^']*'"
_WORD = re.compile(rf"\s*(?:{_NUMBER}(?:\s*(?:{_UNIT})(?!\w))?|{_NAME}|{_TEXT}|{SIGN_PATTERN}|[-+*/])")
_WAYS = {"<": 1.0, "<=": 1.0, ">": -1.0, ">=": -1.0}
_PLANS = ("true", "maneuverisdone", "maneuverisdone()")


@dataclass(frozen=True)
class Scope:
    """The vehicles whose messages a text may name, with their schemas; `vehicle` is meant if it names none."""

    vehicles: Mapping[str, imc.Schema]
    vehicle: str = ""


@dataclass(frozen=True, eq=False)
class Condition:
    """A condition. `margin(latest)` takes the latest message of each of its `watches`, None if there is none yet.

    The margin is positive if the condition holds, with any distance left, and NaN as long as messages are missing that
    decide it. For `holds`, a comparison with a message that is missing is false, as in plans.
    """

    text: str
    watches: tuple[Watch, ...]
    test: Margin

    def margin(self, latest: Latest) -> float:
        return self.test(latest, math.nan)

    def holds(self, latest: Latest) -> bool:
        return self.test(latest, -math.inf) > 0.0


class Expression(NamedTuple):
    """A number that follows from messages. `value` takes the latest one of each watch, of which none may be missing."""

    text: str
    watches: tuple[Watch, ...]
    value: Callable[[Latest], float]
    unit: str
    is_enumeration: bool = False


def parse(text: str, scope: Scope) -> Condition:
    """Parse a condition. Raises ValueError with the reason."""
    operands = Operands(scope.vehicles, scope.vehicle)

    def single(logic: GrammarParser[Margin]) -> Margin:
        if logic.word is not None and logic.word.lower() in _PLANS:
            raise ValueError(f"{logic.word!r} is for plans only: compare PlanControlState.man_id or .state instead")
        return _comparison(operands, logic)

    test = GrammarParser[Margin](text, _WORD, single, CONNECTIVES, sums=True).parse()
    return Condition(text, tuple(operands.watches), test)


def parse_expression(text: str, scope: Scope) -> Expression:
    """Parse an expression. Raises ValueError with the reason."""
    operands = Operands(scope.vehicles, scope.vehicle)
    logic = GrammarParser[Margin](text, _WORD, lambda logic: _comparison(operands, logic), CONNECTIVES, sums=True)
    operand = operands.sum(logic)
    logic.end()
    operand.must_be_number()
    return Expression(text, tuple(operands.watches), operand.value, operand.unit, operand.enum is not None)


def read_condition(node: Node, scope: Scope) -> Condition:
    """The condition in a file. Raises the error of the file, which names the line."""
    return _read(node, scope, parse)


def read_expression(node: Node, scope: Scope) -> Expression:
    """The expression in a file. Raises the error of the file, which names the line."""
    return _read(node, scope, parse_expression)


def _read(node: Node, scope: Scope, parse: Callable[[str, Scope], T]) -> T:
    text = node.text()
    try:
        found = parse(text, scope)
    except ValueError as error:
        node.fail(f"{text}: {error}")
    if not found.watches:
        node.fail(f"{text}: names no message, so nothing can change it")
    return found


def _comparison(operands: Operands, logic: GrammarParser[Margin]) -> Margin:
    left = operands.sum(logic)
    sign = logic.word
    compare = logic.expect_comparison()
    right = operands.sum(logic)
    if logic.word in COMPARISONS:
        raise ValueError(f"{logic.word!r} is not expected: join two comparisons by and")
    left, right = _named(left, right), _named(right, left)
    is_text = left.is_text or right.is_text
    if is_text and not (left.is_text and right.is_text and sign in ("==", "!=")):
        raise ValueError("a text can only be compared with a text, by == or !=")
    if not is_text:
        left.must_fit(right)
    measure = verdict if is_text or left.enum is not None or right.enum is not None else gap
    a, b, needs = left.value, right.value, tuple(sorted(left.needs | right.needs))
    if len(needs) == 1:
        (only,) = needs
        if measure is gap and not right.needs and sign in _WAYS:
            return _bound(only, a, _WAYS[sign], b(()), compare)
        return lambda latest, unknown: unknown if latest[only] is None else measure(compare, a(latest), b(latest))

    def test(latest: Latest, unknown: float) -> float:
        for index in needs:
            if latest[index] is None:
                return unknown
        return measure(compare, a(latest), b(latest))

    return test


def _bound(
    only: int, a: Callable[[Latest], float], way: float, limit: float, compare: Callable[[float, float], bool]
) -> Margin:
    """A comparison with a constant, which is by far the most frequent one."""

    def test(latest: Latest, unknown: float) -> float:
        if latest[only] is None:
            return unknown
        value = a(latest)
        margin = way * (limit - value)
        return margin if 0.0 < margin < math.inf or -math.inf < margin < 0.0 else gap(compare, value, limit)

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
