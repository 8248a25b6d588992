"""The sides of a comparison: values of messages with their units; sums, products and functions of these."""

import math
import operator
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import IntEnum, IntFlag
from typing import Any

from imc.expressions.functions import FUNCTIONS, ExpressionFunction
from imc.expressions.robustness import LatestMessages
from support.expressions import Call, ExpressionError, Number, SyntaxNode
from support.terminal_text import with_suggestion
from support.units import UNITS

_SPECIAL = ("inf", "infinity", "nan")


@dataclass(frozen=True)
class Operand:
    """`value` is a function of the slots, of which none that it `needs` may be None.

    It is not known, either, while one of `unready` is true. While `may_grow` is true, silence makes it larger than it
    is: the age of a message that never arrived. `unit` is empty if it is not known, `enum` has the names of its values.
    `has_any_type` if only the run shows whether it is a number, a text, or None for what is not there. A `name` is not
    understood by itself: it may be a value of the other side's enumeration, and `known` is what else it might mean.
    """

    node: SyntaxNode
    value: Callable[[LatestMessages], Any]
    needs: frozenset[int] = frozenset()
    unready: tuple[Callable[[LatestMessages], bool], ...] = ()
    may_grow: Callable[[LatestMessages], bool] | None = None
    unit: str = ""
    enum: type[IntEnum] | type[IntFlag] | None = None
    is_text: bool = False
    has_any_type: bool = False
    name: str = ""
    known: tuple[str, ...] = field(default=(), compare=False)

    @property
    def text(self) -> str:
        """Text of the operand, as in an expression."""
        return self.node.text

    @property
    def is_constant(self) -> bool:
        """Whether the value is always the same."""
        return not self.needs and not self.unready

    def error(self, reason: str) -> ExpressionError:
        """A mistake in it."""
        return self.node.error(reason)

    def check_is_number(self) -> None:
        """Raise ExpressionError if it is a text, or a name."""
        if self.name:
            reason = f"{self.name!r} is neither a number nor Message.field"
            raise self.error(with_suggestion(reason, self.name, self.known))
        if self.is_text:
            raise self.error(f"{self.text} is a text, not a number")

    def check_units(self, other: "Operand") -> str:
        """The unit of both. Raises ExpressionError if they differ."""
        if self.unit and other.unit and self.unit != other.unit:
            raise other.error(f"{self.text} is in {self.unit}, but {other.text} is in {other.unit}")
        return self.unit or other.unit

    def is_known(self, latest: LatestMessages) -> bool:
        """Whether the operand has a value."""
        return all(latest[index] is not None for index in self.needs) and not any(
            unready(latest) for unready in self.unready
        )


def number_operand(node: Number) -> Operand:
    """A number in SI."""
    unit = UNITS.get(node.symbol)
    number = node.value if unit is None else unit.to_si(node.value)
    if not math.isfinite(number):
        raise node.error(f"{node.text} is too large a number")
    return Operand(node, lambda _: number, unit=unit.si if unit is not None else "")


def is_special(word: str) -> bool:
    """Whether a word is infinity or NaN."""
    return word.lower() in _SPECIAL


def special_number(node: SyntaxNode, word: str) -> Operand | None:
    """Infinity or NaN, if the word is one of these."""
    if not is_special(word):
        return None
    number = float(word)
    return Operand(node, lambda _: number)


def negative(node: SyntaxNode, inner: Operand) -> Operand:
    """The negative of a number."""
    inner.check_is_number()
    return replace(inner, node=node, value=_applied(_negate, inner), enum=None, may_grow=None, unready=_all(inner))


def add_up(node: SyntaxNode, first: Operand, rest: "list[tuple[str, Operand]]") -> Operand:
    """A sum of numbers in one unit."""
    found = first
    for sign, other in rest:
        found.check_is_number()
        other.check_is_number()
        unit = found.check_units(other)
        found = _result(node, operator.add if sign == "+" else operator.sub, [found, other], unit)
    return found


def multiply(node: SyntaxNode, first: Operand, rest: "list[tuple[str, Operand]]") -> Operand:
    """A product of numbers. It keeps the unit of the one that has a unit, if the others are plain numbers."""
    found = first
    for sign, other in rest:
        found.check_is_number()
        other.check_is_number()
        plain = other if not other.needs and not other.unit else found if sign == "*" else None
        kept = (found if plain is other else other).unit if plain and not plain.unit and not plain.needs else ""
        found = _result(node, _multiply if sign == "*" else _divide, [found, other], kept)
    return found


def call_function(node: Call, given: "list[Operand]") -> Operand:
    """A function of numbers in one unit. Raises ExpressionError if there are too few or too many."""
    function = FUNCTIONS[node.function]
    if not function.least <= len(given) <= function.most:
        raise node.error(f"{node.function} takes {_amount(function)}, not {len(given)}")
    first = next((operand for operand in given if operand.unit), given[0])
    for operand in given:
        operand.check_is_number()
        first.check_units(operand)
    return _result(node, function.call, given, first.unit if function.keeps_unit else "")


def _amount(function: ExpressionFunction) -> str:
    if function.least == function.most:
        return f"{function.least} value{'s' * (function.least > 1)}"
    return f"{function.least} to {function.most} values"


def _all(operand: Operand) -> tuple[Callable[[LatestMessages], bool], ...]:
    """Reason why an operand is not known, also within another one: what may grow there is not known yet."""
    return operand.unready if operand.may_grow is None else (*operand.unready, operand.may_grow)


def _result(node: SyntaxNode, function: Callable[..., float], given: "list[Operand]", unit: str) -> Operand:
    """The value of a function of operands."""
    return Operand(
        node,
        _applied(function, *given),
        frozenset[int]().union(*(operand.needs for operand in given)),
        tuple(unready for operand in given for unready in _all(operand)),
        unit=unit,
        has_any_type=any(operand.has_any_type for operand in given),
    )


def _applied(function: Callable[..., float], *given: Operand) -> Callable[[LatestMessages], Any]:
    """A function of operands; its value is None where the run shows that one of them is no number."""
    values = [operand.value for operand in given]
    if any(operand.has_any_type for operand in given):

        def value(latest: LatestMessages) -> float | None:
            found = [value(latest) for value in values]
            return function(*found) if all(isinstance(each, int | float) for each in found) else None

        return value
    (only, *more) = values
    return (
        (lambda latest: function(*[value(latest) for value in values]))
        if more
        else lambda latest: function(only(latest))
    )


def _negate(number: float) -> float:
    return -number


def _multiply(a: float, b: float) -> float:
    return float(a) * b  # of many integers, too: their product may be beyond any float


def _divide(a: float, b: float) -> float:
    return a / b if b else math.nan
