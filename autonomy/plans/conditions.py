"""Conditions of transitions: ManeuverIsDone, comparisons such as FuelLevel.value < 20 %, and, or, not."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

import imc
from imc.expressions import ExpressionCompiler, FieldPlace, NameScope, RobustnessFunction
from support.expressions import Call, Name, parse_tree
from support.terminal_text import with_suggestion

LatestMessages: TypeAlias = Mapping[type[imc.Message], imc.Message]
Test = Callable[[LatestMessages, bool], bool]
DONE_WORDS = ("true", "maneuverisdone")


@dataclass(frozen=True)
class Condition:
    """A condition and the messages that it uses.

    `holds` takes the latest message of each type and whether the maneuver is done. A comparison with a message that
    has not arrived yet is false. An empty condition and "true" are ManeuverIsDone.
    """

    text: str
    holds: Test
    kinds: frozenset[type[imc.Message]]


def parse_condition(text: str) -> Condition:
    """Parse a condition. Raises ValueError with the reason, and with the place of the mistake."""
    if not text.strip():
        return Condition(text, lambda _, done: done, frozenset())
    scope = _PlanScope()
    test = ExpressionCompiler(scope).test(parse_tree(text))
    kinds = tuple(scope.slots)

    def holds(latest: LatestMessages, done: bool) -> bool:
        return test([done, *map(latest.get, kinds)], -math.inf) > 0.0

    return Condition(text, holds, frozenset(kinds))


class _PlanScope(NameScope):
    """The messages of the vehicle itself; the first slot has whether the maneuver is done."""

    def __init__(self) -> None:
        self.slots: dict[type[imc.Message], int] = {}

    def place(self, node: Name) -> FieldPlace | None:
        if node.vehicle or node.receiver or node.entity is not None:
            raise node.error(f"{node.text!r}: a plan compares its own vehicle's messages of a type: Message.field")
        schema = imc.builtin()
        if node.name not in schema:
            if node.is_bare:
                return None
            reason = f"{node.text!r} is neither ManeuverIsDone nor Message.field"
            raise node.error(with_suggestion(reason, node.name, schema.types))
        kind = schema[node.name]
        return FieldPlace(kind, self.slots.setdefault(kind, len(self.slots) + 1), node.path)

    def test(self, node: Call | Name, compiler: ExpressionCompiler) -> RobustnessFunction | None:
        word = node.name if isinstance(node, Name) else "" if node.arguments else node.function
        if word.lower() in DONE_WORDS:
            return lambda latest, _: math.inf if latest[0] else -math.inf
        if isinstance(node, Name) and node.is_bare:
            raise node.error(f"{node.text!r} is neither ManeuverIsDone nor Message.field")
        return None
