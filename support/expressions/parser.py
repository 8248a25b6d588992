"""Reads an expression by recursive descent: or, and, not, comparison, sum, product, sign, in this order of binding."""

import re
from collections.abc import Callable
from typing import NamedTuple, TypeVar

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
from support.units import UNITS, unit_suggestion

R = TypeVar("R")
MAX_CHARACTERS = 1000
MAX_NESTING = 50
"""Greatest depth of nested brackets, calls, signs and negations."""

COMPARISONS = ("<", "<=", ">", ">=", "==", "!=", "~")
_CORRECTIONS = {"=>": ">=", "=<": "<=", "=": "==", "&": "and", "|": "or"}
_SYMBOLS = "|".join(map(re.escape, sorted(UNITS, key=len, reverse=True)))
_VEHICLE = r"\w+(?:[-.]\w+)*"
_WORD = re.compile(
    rf"""\s*(?:
    (?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(?:\s*(?P<symbol>{_SYMBOLS})(?![\w²°%]))?
    |(?P<name>[A-Za-z_]\w*)(?:\[(?P<entity>[^\]]*)\])?(?P<path>(?:\.\w+)*)
        (?:@(?P<vehicle>{_VEHICLE}))?(?:->(?P<receiver>{_VEHICLE}))?
    |\$(?P<captured>[A-Za-z_]\w*)
    |(?P<text>"[^"]*"|'[^']*')
    |(?P<sign><=|>=|==|!=|<|>|~|&&|\|\||[-+*/!(),])
    )""",
    re.VERBOSE,
)
_UNKNOWN_UNIT = re.compile(r"[A-Za-z°%µ][A-Za-z°%µ²/]*")
_KEYWORDS = {"and": "and", "&&": "and", "or": "or", "||": "or", "not": "not", "!": "not"}


class _Word(NamedTuple):
    """A word: `kind` is that of the pattern, `value` its short text."""

    kind: str
    value: str
    match: "re.Match[str]"
    start: int
    end: int


def parse_tree(text: str) -> SyntaxNode:
    """The tree of a text. Raises ExpressionError with the place of the mistake."""
    return _Parser(text).parse()


class _Parser:
    def __init__(self, text: str):
        if len(text) > MAX_CHARACTERS:
            raise ExpressionError(f"has more than {MAX_CHARACTERS} characters")
        self._text = text.rstrip()
        self._words = self._split()
        self._next = 0
        self._depth = 0

    def parse(self) -> SyntaxNode:
        found = self._alternatives(joins_by_comma=True)
        word = self._word
        if word is not None:
            follows_number = self._words[self._next - 1].kind == "number" and word.match["name"] == word.value
            reason = _no_unit(word.value) if follows_number else f"{word.value!r} is not expected"
            raise ExpressionError(reason, word.start)
        return found

    def _split(self) -> list[_Word]:
        words: list[_Word] = []
        at = 0
        while at < len(self._text):
            match = _WORD.match(self._text, at)
            if match is None:
                raise self._not_understood(at)
            kind = match.lastgroup if match.lastgroup in ("captured", "text", "sign") else ""
            kind = kind or ("number" if match["number"] else "name")
            start = match.end() - len(match.group().lstrip())
            word = match.group().strip()
            if kind == "number":
                self._check_number_end(match)
            keyword = _KEYWORDS.get(word.lower()) if kind in ("name", "sign") else None
            words.append(_Word("sign" if keyword else kind, keyword or word, match, start, match.end()))
            at = match.end()
        return words

    def _not_understood(self, at: int) -> ExpressionError:
        rest = self._text[at:]
        start = at + len(rest) - len(rest.lstrip())
        found = rest.split()[0]
        meant = next((f"; write {right}" for wrong, right in _CORRECTIONS.items() if found.startswith(wrong)), "")
        return ExpressionError(f"{found!r} is not understood{meant}", start)

    def _check_number_end(self, match: "re.Match[str]") -> None:
        """Reject a number with letters right behind it that are no unit: 3kmh, 5mn."""
        end = match.end("number")
        wrong = _UNKNOWN_UNIT.match(self._text, end) if match["symbol"] is None else None
        if wrong is not None and wrong.group().lower() not in _KEYWORDS:
            raise ExpressionError(_no_unit(wrong.group()), end)

    @property
    def _word(self) -> _Word | None:
        return self._words[self._next] if self._next < len(self._words) else None

    def _accept(self, *signs: str) -> str:
        """The next word if it is one of these signs, which is then taken; else empty."""
        word = self._word
        if word is None or word.kind != "sign" or word.value not in signs:
            return ""
        self._next += 1
        return word.value

    def _place(self) -> int:
        word = self._word
        return len(self._text) if word is None else word.start

    def _written(self, start: int) -> tuple[str, int]:
        end = self._words[self._next - 1].end
        return self._text[start:end], start

    def _nested(self, read: Callable[[], R]) -> R:
        self._depth += 1
        if self._depth > MAX_NESTING:
            raise ExpressionError(f"is nested more than {MAX_NESTING} times", self._place())
        found = read()
        self._depth -= 1
        return found

    def _alternatives(self, *, joins_by_comma: bool) -> SyntaxNode:
        start = self._place()
        parts = [self._conjunction(joins_by_comma)]
        while self._accept("or"):
            _check_condition(parts[-1])
            parts.append(_check_condition(self._conjunction(joins_by_comma)))
        if len(parts) == 1:
            return parts[0]
        text, at = self._written(start)
        return Any(tuple(parts), text=text, at=at)

    def _conjunction(self, joins_by_comma: bool) -> SyntaxNode:
        start, signs = self._place(), ("and", ",") if joins_by_comma else ("and",)
        parts = [self._negation()]
        while self._accept(*signs):
            _check_condition(parts[-1])
            parts.append(_check_condition(self._negation()))
        if len(parts) == 1:
            return parts[0]
        text, at = self._written(start)
        return All(tuple(parts), text=text, at=at)

    def _negation(self) -> SyntaxNode:
        start = self._place()
        if not self._accept("not"):
            return self._comparison()
        inside = _check_condition(self._nested(self._negation))
        text, at = self._written(start)
        return Not(inside, text=text, at=at)

    def _comparison(self) -> SyntaxNode:
        start = self._place()
        left = self._sum()
        sign = self._accept(*COMPARISONS)
        if not sign:
            return left
        right = _check_value(self._sum())
        if self._word is not None and self._word.value in COMPARISONS:
            raise ExpressionError(
                f"{self._word.value!r} is not expected: join two comparisons by and", self._word.start
            )
        text, at = self._written(start)
        return Comparison(sign, _check_value(left), right, text=text, at=at)

    def _sum(self) -> SyntaxNode:
        start = self._place()
        first = self._product()
        rest: list[tuple[str, SyntaxNode]] = []
        while sign := self._accept("+", "-"):
            rest.append((sign, _check_value(self._product())))
        if not rest:
            return first
        text, at = self._written(start)
        return Sum(_check_value(first), tuple(rest), text=text, at=at)

    def _product(self) -> SyntaxNode:
        start = self._place()
        first = self._sign()
        rest: list[tuple[str, SyntaxNode]] = []
        while sign := self._accept("*", "/"):
            rest.append((sign, _check_value(self._sign())))
        if not rest:
            return first
        text, at = self._written(start)
        return Product(_check_value(first), tuple(rest), text=text, at=at)

    def _sign(self) -> SyntaxNode:
        start = self._place()
        if self._accept("-"):
            inside = _check_value(self._nested(self._sign))
            text, at = self._written(start)
            return Negative(inside, text=text, at=at)
        if self._accept("+"):
            return _check_value(self._nested(self._sign))
        return self._primary()

    def _primary(self) -> SyntaxNode:
        word = self._word
        if word is None:
            raise ExpressionError("a number or Message.field is missing", len(self._text))
        self._next += 1
        if word.kind == "sign":
            if word.value != "(":
                raise ExpressionError(f"{word.value!r} is not expected", word.start)
            inside = self._nested(lambda: self._alternatives(joins_by_comma=True))
            self._close()
            return inside
        text, start, match = self._text[word.start : word.end], word.start, word.match
        if word.kind == "number":
            return Number(float(match["number"]), match["symbol"] or "", text=text, at=start)
        if word.kind == "text":
            return Text(match["text"][1:-1], text=text, at=start)
        if word.kind == "captured":
            return CapturedName(match["captured"], text=text, at=start)
        name = Name(
            match["name"],
            match["path"].removeprefix("."),
            match["entity"].strip() if match["entity"] is not None else None,
            match["vehicle"] or "",
            match["receiver"] or "",
            text=text,
            at=start,
        )
        return self._call(name) if name.is_bare and self._accept("(") else name

    def _call(self, name: Name) -> Call:
        arguments: list[SyntaxNode] = []
        if not self._accept(")"):
            arguments.append(self._nested(lambda: self._alternatives(joins_by_comma=False)))
            while self._accept(","):
                arguments.append(self._nested(lambda: self._alternatives(joins_by_comma=False)))
            self._close()
        text, at = self._written(name.at)
        return Call(name.name, tuple(arguments), text=text, at=at)

    def _close(self) -> None:
        if not self._accept(")"):
            raise ExpressionError("a ) is missing", self._place())


def _no_unit(symbol: str) -> str:
    hint = unit_suggestion(symbol)
    return f"there is no unit {symbol!r}" + f" ({hint})" * bool(hint)


def _check_condition(node: SyntaxNode) -> SyntaxNode:
    """Reject a value where a condition belongs; what a word or a call alone means is decided by its user."""
    if isinstance(node, (*CONDITION_TYPES, Call)) or (isinstance(node, Name) and node.is_bare):
        return node
    raise ExpressionError("a comparison is missing", node.at + len(node.text))


def _check_value(node: SyntaxNode) -> SyntaxNode:
    if isinstance(node, CONDITION_TYPES):
        raise node.error(f"{node.text} is true or false, not a number")
    return node
