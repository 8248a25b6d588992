"""Meaning of expressions of messages: fields with their units, functions, comparisons and by how much they are met."""

from imc.expressions.compiler import HEADER, ExpressionCompiler, FieldPlace, NameScope
from imc.expressions.functions import contains_position
from imc.expressions.operands import Operand, is_special
from imc.expressions.robustness import (
    NO_NUMBER,
    LatestMessages,
    RobustnessFunction,
    comparison_robustness,
    displayable_margin,
    is_unknown,
    negate_unless_nan,
    violation_text,
)

__all__ = [
    "HEADER",
    "NO_NUMBER",
    "ExpressionCompiler",
    "FieldPlace",
    "LatestMessages",
    "NameScope",
    "Operand",
    "RobustnessFunction",
    "comparison_robustness",
    "contains_position",
    "displayable_margin",
    "is_special",
    "is_unknown",
    "negate_unless_nan",
    "violation_text",
]
