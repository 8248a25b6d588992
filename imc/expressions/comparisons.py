"""The margin of a comparison of two operands."""

import math
import operator
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, cast

from imc.expressions.operands import Operand
from imc.expressions.robustness import (
    LatestMessages,
    RobustnessFunction,
    boolean_robustness,
    comparison_robustness,
)
from support.expressions import Comparison
from support.terminal_text import with_suggestion

Relation = Callable[[Any, Any], bool]
_WAYS = {"<": 1.0, "<=": 1.0, ">": -1.0, ">=": -1.0}
_RELATIONS: Mapping[str, Relation] = MappingProxyType(
    {
        "<": operator.lt,
        "<=": operator.le,
        ">": operator.gt,
        ">=": operator.ge,
        "==": operator.eq,
        "!=": operator.ne,
    }
)


def compare_operands(node: Comparison, left: Operand, right: Operand) -> RobustnessFunction:
    """The test of a comparison. Raises ExpressionError if its sides cannot be compared."""
    sign = node.sign
    left, right = _named(left, right), _named(right, left)
    is_text = left.is_text or right.is_text
    compare = _contains(left, right) if sign == "~" else _RELATIONS[sign]
    if left.has_any_type or right.has_any_type:
        return _guarded(_if_alike(compare), left, right)
    if is_text and not (left.is_text and right.is_text and sign in ("==", "!=", "~")):
        raise node.error("a text can only be compared with a text, by ==, != or ~")
    if not is_text:
        left.check_units(right)
    if is_text or sign == "~" or left.enum is not None or right.enum is not None:
        return _guarded(lambda a, b: boolean_robustness(compare, a, b), left, right)
    if left.may_grow is not None or right.may_grow is not None:
        return _growing(sign, compare, left, right)
    if len(left.needs) == 1 and right.is_constant and not left.unready and sign in _WAYS:
        (only,) = left.needs
        return _bound(only, left.value, _WAYS[sign], right.value(()), compare)
    return _guarded(lambda a, b: comparison_robustness(compare, a, b), left, right)


def _guarded(measure: Callable[[Any, Any], float], left: Operand, right: Operand) -> RobustnessFunction:
    """The margin as soon as both sides are known."""
    a, b, needs = left.value, right.value, tuple(sorted(left.needs | right.needs))
    unready = (*left.unready, *right.unready)
    if len(needs) == 1 and not unready:
        (only,) = needs
        return lambda latest, unknown: unknown if latest[only] is None else measure(a(latest), b(latest))

    def test(latest: LatestMessages, unknown: float) -> float:
        for index in needs:
            if latest[index] is None:
                return unknown
        for not_yet in unready:
            if not_yet(latest):
                return unknown
        return measure(a(latest), b(latest))

    return test


def _growing(sign: str, compare: Relation, left: Operand, right: Operand) -> RobustnessFunction:
    """The margin of what may still grow: unknown unless it stays true, or false, while it grows."""
    final = _guarded(lambda a, b: comparison_robustness(compare, a, b), left, right)
    left_grows, right_grows = left.may_grow, right.may_grow

    def test(latest: LatestMessages, unknown: float) -> float:
        margin = final(latest, unknown)
        of_left = left_grows is not None and left_grows(latest)
        of_right = right_grows is not None and right_grows(latest)
        if not (of_left or of_right):
            return margin
        if of_left and of_right:
            return unknown
        if sign in ("<", "<="):
            is_final = margin <= 0.0 if of_left else margin > 0.0
        elif sign in (">", ">="):
            is_final = margin > 0.0 if of_left else margin <= 0.0
        else:
            is_final = False
        return margin if is_final else unknown

    return test


def _bound(
    only: int, a: Callable[[LatestMessages], float], way: float, limit: float, compare: Relation
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


def _contains(left: Operand, right: Operand) -> Relation:
    """A text in a text, ignoring case, or a bit in a bit field."""
    if not (left.is_text or left.has_any_type) and right.is_text:
        raise right.error(f"{left.text} is a number: ~ needs a bit there, not a text")
    if left.is_text and not (right.is_text or right.has_any_type):
        raise right.error(f"{left.text} ~ needs a text in quotes")
    return _contains_value


def _contains_value(value: Any, wanted: Any) -> bool:
    if isinstance(wanted, str):
        return wanted.lower() in cast(str, value).lower()
    try:
        return bool(int(value) & int(wanted))
    except (ValueError, OverflowError):  # not a number, or infinite
        return False


def _if_alike(compare: Relation) -> Callable[[Any, Any], float]:
    """A comparison of values whose types only the run shows: others than two numbers or two texts are not equal."""

    def measure(a: Any, b: Any) -> float:
        is_alike = any(isinstance(a, kind) and isinstance(b, kind) for kind in (str, int | float))
        return boolean_robustness(compare, a, b) if is_alike else -math.inf

    return measure


def _named(operand: Operand, other: Operand) -> Operand:
    """A name as the value that the enumeration of the other side gives it."""
    if not operand.name:
        return operand
    if other.enum is None:
        operand.check_is_number()
        raise AssertionError
    names = other.enum.__members__
    if operand.name not in names:
        reason = f"{operand.name!r} is not a value of {other.text}"
        raise operand.error(with_suggestion(reason, operand.name, list(names)))
    number = float(other.enum[operand.name])
    return Operand(operand.node, lambda _: number, enum=other.enum)
