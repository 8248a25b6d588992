"""Conditions on messages, and expressions of their fields, as texts and in files."""

from collections.abc import Callable
from typing import TypeVar

from imc.expressions import ExpressionCompiler, LatestMessages, Operand
from shoal.scenarios.message_names import ExpressionScope, ScenarioNames
from shoal.scenarios.scenario_condition import MessageExpression, ScenarioCondition
from support.expressions import CONDITION_TYPES, ExpressionError, parse_tree
from support.located_yaml import Node

T = TypeVar("T", "ScenarioCondition", "MessageExpression")


def parse_scenario_condition(text: str, scope: ExpressionScope) -> ScenarioCondition:
    """Parse a condition. Raises ValueError with the reason, and with the place of the mistake."""
    names = ScenarioNames(scope)
    test = ExpressionCompiler(names).test(parse_tree(text))
    return ScenarioCondition(text, tuple(names.selectors), test)


def parse_expression(text: str, scope: ExpressionScope) -> MessageExpression:
    """Parse an expression. Raises ValueError with the reason, and with the place of the mistake."""
    names, tree = ScenarioNames(scope), parse_tree(text)
    if isinstance(tree, CONDITION_TYPES):
        raise ExpressionError(f"{text} is true or false, not a number")
    operand = ExpressionCompiler(names).operand(tree)
    operand.check_is_number()
    is_simple = not operand.unready and operand.may_grow is None and not operand.has_any_type
    return MessageExpression(
        text,
        tuple(names.selectors),
        operand.value,
        operand.unit,
        _known_test(operand),
        is_simple and len(operand.needs) == len(names.selectors),
        operand.enum is not None,
    )


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


def _known_test(operand: Operand) -> Callable[[LatestMessages], bool]:
    may_grow = operand.may_grow

    def is_known(latest: LatestMessages) -> bool:
        if not operand.is_known(latest) or (may_grow is not None and may_grow(latest)):
            return False
        return not operand.has_any_type or isinstance(operand.value(latest), int | float)

    return is_known
