"""The tree of an expression: the content of a text, before its names have a meaning."""

from dataclasses import dataclass, field
from typing import TypeAlias


class ExpressionError(ValueError):
    """A mistake in an expression: `reason`, and `at`, the place of its first character; None if it is the whole."""

    def __init__(self, reason: str, at: int | None = None):
        super().__init__(reason if at is None else f"{reason}, at character {at + 1}")
        self.reason = reason
        self.at = at


@dataclass(frozen=True)
class _Node:
    """A part of an expression: `text` is how it is written, `at` where it begins."""

    text: str = field(default="", compare=False, kw_only=True)
    at: int = field(default=0, compare=False, kw_only=True)

    def error(self, reason: str) -> ExpressionError:
        """A mistake in this part."""
        return ExpressionError(reason, self.at)


@dataclass(frozen=True)
class Number(_Node):
    """A number, with the symbol of its unit or an empty one."""

    value: float
    symbol: str = ""


@dataclass(frozen=True)
class Text(_Node):
    """A text in quotes."""

    value: str


@dataclass(frozen=True)
class Name(_Node):
    """A name such as depth, EstimatedState.depth, or Temperature[CTD].value@sender->receiver.

    `path` is what follows the first point. What is not written is empty, but `entity` is None.
    """

    name: str
    path: str = ""
    entity: str | None = None
    vehicle: str = ""
    receiver: str = ""

    @property
    def is_bare(self) -> bool:
        """Whether the name is one word, such as that of an enumeration."""
        return not self.path and self.entity is None and not self.vehicle and not self.receiver


@dataclass(frozen=True)
class CapturedName(_Node):
    """The name of a captured value: $name."""

    name: str


@dataclass(frozen=True)
class Call(_Node):
    """A function with its arguments, which may be conditions."""

    function: str
    arguments: "tuple[SyntaxNode, ...]"


@dataclass(frozen=True)
class Negative(_Node):
    """The negative of a value."""

    value: "SyntaxNode"


@dataclass(frozen=True)
class Sum(_Node):
    """The first value, and what is added to it (+) or subtracted (-)."""

    first: "SyntaxNode"
    rest: "tuple[tuple[str, SyntaxNode], ...]"


@dataclass(frozen=True)
class Product(_Node):
    """The first value, and what it is multiplied (*) or divided by (/)."""

    first: "SyntaxNode"
    rest: "tuple[tuple[str, SyntaxNode], ...]"


@dataclass(frozen=True)
class Comparison(_Node):
    """Two values and <, <=, >, >=, ==, != or ~, which means contains."""

    sign: str
    left: "SyntaxNode"
    right: "SyntaxNode"


@dataclass(frozen=True)
class Not(_Node):
    """The negation of a condition."""

    condition: "SyntaxNode"


@dataclass(frozen=True)
class All(_Node):
    """Conditions that all hold."""

    conditions: "tuple[SyntaxNode, ...]"


@dataclass(frozen=True)
class Any(_Node):
    """Conditions of which one holds."""

    conditions: "tuple[SyntaxNode, ...]"


SyntaxNode: TypeAlias = (
    Number | Text | Name | CapturedName | Call | Negative | Sum | Product | Comparison | Not | All | Any
)
CONDITION_TYPES = (Comparison, Not, All, Any)
"""The parts that are true or false; a name or a call may be so, too."""
