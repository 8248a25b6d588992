"""Compiles the condition of a transition: comparisons with the vehicle's own messages, and, or, not."""

import math
from collections.abc import Callable, Collection, Sequence

import imc
from imc.expressions import ExpressionCompiler, FieldPlace, NameScope, RobustnessFunction
from support.expressions import Call, Name, parse_tree
from support.terminal_text import with_suggestion


def compile_test(
    text: str, done_words: Collection[str]
) -> tuple[Callable[[Sequence[object]], bool], tuple[type[imc.Message], ...]]:
    """A test of whether the maneuver is done and of the latest messages of these types, None for those without any.

    `done_words`, in lower case, stand for ManeuverIsDone. Raises ValueError with the place of the mistake.
    """
    scope = _PlanScope(done_words)
    test = ExpressionCompiler(scope).test(parse_tree(text))
    return lambda latest: test(latest, -math.inf) > 0.0, tuple(scope.slots)


class _PlanScope(NameScope):
    """The messages of the vehicle itself; the first slot has whether the maneuver is done."""

    def __init__(self, done_words: Collection[str]) -> None:
        self._done_words = done_words
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
        if word.lower() in self._done_words:
            return lambda latest, _: math.inf if latest[0] else -math.inf
        if isinstance(node, Name) and node.is_bare:
            raise node.error(f"{node.text!r} is neither ManeuverIsDone nor Message.field")
        return None
