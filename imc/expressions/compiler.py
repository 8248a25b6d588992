"""Gives the tree of an expression its meaning: a function of the latest messages."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, NamedTuple

from imc.expressions.comparisons import compare_operands
from imc.expressions.functions import FUNCTIONS, contains_position, distance
from imc.expressions.operands import (
    Operand,
    add_up,
    call_function,
    multiply,
    negative,
    number_operand,
    special_number,
)
from imc.expressions.robustness import LatestMessages, RobustnessFunction, conjunction, disjunction, negate
from imc.layout import NUMBERS
from imc.message import Message
from imc.schema import FieldInfo, fields
from support import expressions as tree
from support.expressions import ExpressionError, SyntaxNode
from support.terminal_text import with_suggestion

HEADER = ("src", "src_ent", "dst", "dst_ent", "timestamp")
_ENUMERATIONS = ("Enumerated", "Bitfield")
_OF_RUNS = ("age", "altitude", "count", "held", "rate")  # what needs a history, or a simulated world
_CONTAINS = "contains"
_DISTANCE = "distance"


class FieldPlace(NamedTuple):
    """A message of a kind in a slot, and the path of a field in it; empty if the message itself is meant."""

    kind: type[Message]
    slot: int
    path: str


class NameScope(ABC):
    """Meaning of names, and functions besides those of numbers, `contains` and `distance`."""

    functions: tuple[str, ...] = ()
    accepts_nan: bool = True  # old plans and scenarios may compare with it

    @abstractmethod
    def place(self, node: tree.Name) -> FieldPlace | None:
        """The field or message that is meant; None for a word that is neither. Raises ExpressionError."""

    def captured(self, node: tree.CapturedName) -> Operand:
        """A captured value. Raises ExpressionError."""
        raise node.error(f"{node.text}: only scenarios capture values")

    def operand(self, node: tree.Call, compiler: "ExpressionCompiler") -> Operand | None:
        """The number that a further function gives; None if it gives none. Raises ExpressionError."""
        return None

    def test(self, node: "tree.Call | tree.Name", compiler: "ExpressionCompiler") -> RobustnessFunction | None:
        """The test that a further function or a word is; None if it is none. Raises ExpressionError."""
        return None

    def wrong_comparison(self, node: tree.Comparison, error: ExpressionError) -> RobustnessFunction:
        """The test of a comparison with a mistake. By default it raises the error."""
        raise error


class ExpressionCompiler:
    """Makes functions of trees, with the names of a scope."""

    def __init__(self, scope: NameScope):
        self.scope = scope

    def test(self, node: SyntaxNode) -> RobustnessFunction:
        """The test that a condition is. Raises ExpressionError."""
        if isinstance(node, tree.All):
            return conjunction([self.test(each) for each in node.conditions])
        if isinstance(node, tree.Any):
            return disjunction([self.test(each) for each in node.conditions])
        if isinstance(node, tree.Not):
            return negate(self.test(node.condition))
        if isinstance(node, tree.Comparison):
            return self._comparison(node, node.left, node.right)
        if isinstance(node, tree.Call) and node.function == _CONTAINS:
            if len(node.arguments) != 2:
                raise node.error("contains takes a text and what is in it: contains(LogBookEntry.text, 'leak')")
            left, right = node.arguments
            return self._comparison(tree.Comparison("~", left, right, text=node.text, at=node.at), left, right)
        if isinstance(node, tree.Call | tree.Name) and (found := self.scope.test(node, self)) is not None:
            return found
        if isinstance(node, tree.Call) and node.function not in self._functions:
            raise self._no_function(node)
        raise ExpressionError("a comparison is missing", node.at + len(node.text))

    def operand(self, node: SyntaxNode) -> Operand:
        """The number or text that a value is. Raises ExpressionError."""
        if isinstance(node, tree.Number):
            return number_operand(node)
        if isinstance(node, tree.Text):
            value = node.value
            return Operand(node, lambda _: value, is_text=True)
        if isinstance(node, tree.Name):
            return self._name(node)
        if isinstance(node, tree.CapturedName):
            return self.scope.captured(node)
        if isinstance(node, tree.Negative):
            return negative(node, self.operand(node.value))
        if isinstance(node, tree.Sum):
            return add_up(node, self.operand(node.first), [(s, self.operand(n)) for s, n in node.rest])
        if isinstance(node, tree.Product):
            return multiply(node, self.operand(node.first), [(s, self.operand(n)) for s, n in node.rest])
        if isinstance(node, tree.Call):
            return self._call(node)
        raise node.error(f"{node.text} is true or false, not a number")

    def message(self, node: SyntaxNode, function: str) -> FieldPlace:
        """The message that an argument is. Raises ExpressionError."""
        place = self.scope.place(node) if isinstance(node, tree.Name) else None
        if place is None or place.path:
            raise node.error(f"{function} takes messages, such as SimulatedState, not {node.text!r}")
        return place

    @property
    def _functions(self) -> list[str]:
        return [*FUNCTIONS, _CONTAINS, _DISTANCE, *self.scope.functions]

    def _no_function(self, node: tree.Call) -> ExpressionError:
        if node.function in _OF_RUNS:
            return node.error(f"{node.function} is for scenarios only: nothing but the latest messages is known here")
        reason = with_suggestion(f"there is no function {node.function!r}", node.function, self._functions)
        return node.error(reason)

    def _comparison(self, node: tree.Comparison, left: SyntaxNode, right: SyntaxNode) -> RobustnessFunction:
        try:
            return compare_operands(node, self.operand(left), self.operand(right))
        except ExpressionError as error:
            return self.scope.wrong_comparison(node, error)

    def _name(self, node: tree.Name) -> Operand:
        if node.is_bare and (special := special_number(node, node.name)) is not None:
            if not self.scope.accepts_nan and math.isnan(special.value(())):
                raise node.error(f"nothing compares with {node.name}")
            return special
        place = self.scope.place(node)
        if place is None:
            known = tuple(self._functions)
            return Operand(node, lambda _: math.nan, name=node.text, known=known)
        if not place.path:
            example = next((info.name for info in fields(place.kind) if info.type in NUMBERS), "field")
            written = node.text.replace(node.name, f"{node.name}.{example}", 1)
            raise node.error(f"{node.text!r} is a message: write which field, such as {written}")
        return field_operand(node, place)

    def _call(self, node: tree.Call) -> Operand:
        if node.function in FUNCTIONS:
            if not node.arguments:
                raise node.error(f"{node.function} takes a value at least")
            return call_function(node, [self.operand(argument) for argument in node.arguments])
        if node.function == _DISTANCE:
            return self._distance(node)
        if (found := self.scope.operand(node, self)) is not None:
            return found
        if node.function in self._functions:
            raise node.error(f"{node.text} is true or false, not a number")
        raise self._no_function(node)

    def _distance(self, node: tree.Call) -> Operand:
        """Distance between two messages, or from one to a latitude and a longitude."""
        if len(node.arguments) not in (2, 3):
            raise node.error(
                "distance takes two messages, such as distance(SimulatedState, EstimatedState), "
                "or a message, a latitude and a longitude"
            )
        first = self._position(node.arguments[0])
        if len(node.arguments) == 2:
            second = self._position(node.arguments[1])
            needs = frozenset((first.slot, second.slot))
            a, b = first.slot, second.slot
            return Operand(node, lambda latest: distance(latest[a], latest[b]), needs, unit="m")
        lat, lon = (self._angle(argument) for argument in node.arguments[1:])
        of, fixed = first.slot, _FixedPosition(lat, lon)
        return Operand(node, lambda latest: distance(latest[of], fixed), frozenset((of,)), unit="m")

    def _position(self, node: SyntaxNode) -> FieldPlace:
        place = self.message(node, _DISTANCE)
        if not contains_position(place.kind):
            raise node.error(f"{place.kind.__name__} has no position")
        return place

    def _angle(self, node: SyntaxNode) -> float:
        found = self.operand(node)
        found.check_is_number()
        if found.unit != "rad" or not found.is_constant:
            raise node.error(f"{node.text}: a latitude or longitude is a number with its unit, such as 41.185°")
        return float(found.value(()))


class _FixedPosition(NamedTuple):
    lat: float  # rad
    lon: float  # rad


def field_operand(node: tree.Name, place: FieldPlace) -> Operand:
    """A field of a message, or of its header, or of a message inside. Raises ExpressionError."""
    kind, slot, path = place
    infos = {info.name: info for info in fields(kind)}
    name, _, rest = path.partition(".")
    if rest and name in infos and infos[name].type == "message":
        return Operand(node, _inner_getter(slot, path), frozenset((slot,)), has_any_type=True)
    if path in HEADER:
        unit = "s" if path == "timestamp" else ""
        return Operand(node, _getter(slot, path), frozenset((slot,)), unit=unit)
    usable = [name for name, info in infos.items() if info.type in NUMBERS or info.type == "plaintext"]
    if path not in usable:
        raise node.error(with_suggestion(f"{kind.__name__} has no numeric field {path!r}", path, usable))
    info: FieldInfo = infos[path]
    unit = "" if info.unit in _ENUMERATIONS else info.unit
    is_text = info.type == "plaintext"
    return Operand(node, _getter(slot, path), frozenset((slot,)), unit=unit, enum=info.enum, is_text=is_text)


def _getter(slot: int, name: str) -> Callable[[LatestMessages], Any]:
    return lambda latest: getattr(latest[slot], name)


def _inner_getter(slot: int, path: str) -> Callable[[LatestMessages], Any]:
    names = path.split(".")

    def value(latest: LatestMessages) -> Any:
        found: Any = latest[slot]
        for name in names:
            if not isinstance(found, Message) or name not in found.__struct_fields__:
                return None
            found = getattr(found, name)
        return found

    return value
