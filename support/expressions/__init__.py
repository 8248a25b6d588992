"""The grammar of conditions and expressions, without their meaning: trees of texts, and the place of a mistake."""

from support.expressions.parser import MAX_CHARACTERS, MAX_NESTING, parse_tree
from support.expressions.syntax_tree import (
    CONDITION_TYPES,
    All,
    Any,
    Call,
    CapturedName,
    Comparison,
    ExpressionError,
    Name,
    Negative,
    Not,
    Number,
    Product,
    Sum,
    SyntaxNode,
    Text,
)

__all__ = [
    "CONDITION_TYPES",
    "MAX_CHARACTERS",
    "MAX_NESTING",
    "All",
    "Any",
    "Call",
    "CapturedName",
    "Comparison",
    "ExpressionError",
    "Name",
    "Negative",
    "Not",
    "Number",
    "Product",
    "Sum",
    "SyntaxNode",
    "Text",
    "parse_tree",
]
