"""The grammar of tests: and, or, not and brackets around comparisons; what these mean, its user says."""

import operator
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Generic, NamedTuple, ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")
R = TypeVar("R")
MAX_CHARACTERS = 1000  # characters
MAX_NESTING = 50  # nested brackets and negations
COMPARISONS: Mapping[str, Callable[[Any, Any], bool]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "==": operator.eq,
    "!=": operator.ne,
}
CORRECTIONS = {"=>": ">=", "=<": "<=", "=": "==", "&": "and", "|": "or"}
NUMBER_PATTERN = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
SIGN_PATTERN = r"<=|>=|==|!=|<|>|&&|\|\||[!(),]"


class Connectives(NamedTuple, Generic[T]):
    """The test that is true if all tests are, if any is, and if one is not."""

    all_of: Callable[[Sequence[T]], T]
    any_of: Callable[[Sequence[T]], T]
    negation: Callable[[T], T]


def predicate_connectives() -> Connectives[Callable[P, bool]]:
    """What and, or and not mean for functions that say whether something is true."""
    return Connectives(_all_of, _any_of, _negation)


def _all_of(tests: Sequence[Callable[P, bool]]) -> Callable[P, bool]:
    def test(*args: P.args, **kwargs: P.kwargs) -> bool:
        return all(test(*args, **kwargs) for test in tests)

    return test


def _any_of(tests: Sequence[Callable[P, bool]]) -> Callable[P, bool]:
    def test(*args: P.args, **kwargs: P.kwargs) -> bool:
        return any(test(*args, **kwargs) for test in tests)

    return test


def _negation(test: Callable[P, bool]) -> Callable[P, bool]:
    def negation(*args: P.args, **kwargs: P.kwargs) -> bool:
        return not test(*args, **kwargs)

    return negation


class GrammarParser(Generic[T]):
    """Recursive descent over the words of a text; `lookahead_word` is None at the end.

    `pattern` is what a word may be; `read_comparison` reads one comparison by means of `expect_word` and `accept`, and
    returns its test. With `sums`, brackets without a comparison in them are part of a sum, and left to
    `read_comparison`.
    """

    def __init__(
        self,
        text: str,
        pattern: "re.Pattern[str]",
        read_comparison: "Callable[[GrammarParser[T]], T]",
        connectives: Connectives[T],
        *,
        sums: bool = False,
    ):
        if len(text) > MAX_CHARACTERS:
            raise ValueError(f"has more than {MAX_CHARACTERS} characters")
        self._read_single = read_comparison
        self._meaning = connectives
        self._sums = sums
        self._words: list[str] = []
        self._depth = 0
        text, at = text.rstrip(), 0
        while at < len(text):
            found = pattern.match(text, at)
            if found is None:
                rest = text[at:].split()[0]
                meant = next((f"; write {right}" for wrong, right in CORRECTIONS.items() if rest.startswith(wrong)), "")
                raise ValueError(f"{rest!r} is not understood{meant}")
            self._words.append(found.group().strip())
            at = found.end()
        self._words.reverse()

    @property
    def lookahead_word(self) -> str | None:
        return self._words[-1] if self._words else None

    def parse(self) -> T:
        """The test of the whole text. Raises ValueError with the reason."""
        test = self._alternatives()
        self.expect_end()
        return test

    def expect_end(self) -> None:
        """Raise ValueError if there is another word."""
        if self.lookahead_word is not None:
            raise ValueError(f"{self.lookahead_word!r} is not expected")

    def accept(self, *words: str) -> bool:
        """Whether the next word was one of these, which is then taken."""
        found = bool(self._words) and self._words[-1].lower() in words
        if found:
            self._words.pop()
        return found

    def expect_word(self, what: str) -> str:
        if not self._words:
            raise ValueError(f"{what} is missing")
        return self._words.pop()

    def close_group(self) -> None:
        """Take the bracket that ends a group."""
        if not self.accept(")"):
            raise ValueError("a ) is missing")

    def expect_comparison(self) -> Callable[[Any, Any], bool]:
        sign = self.expect_word("a comparison")
        if sign not in COMPARISONS:
            raise ValueError(f"{sign!r} is not a comparison")
        return COMPARISONS[sign]

    def parse_with_nesting_limit(self, read: Callable[[], R]) -> R:
        """What `read` reads one level further inside. Raises ValueError if that is too deep."""
        self._depth += 1
        if self._depth > MAX_NESTING:
            raise ValueError(f"is nested more than {MAX_NESTING} times")
        found = read()
        self._depth -= 1
        return found

    def _alternatives(self) -> T:
        tests = [self._all()]
        while self.accept("or", "||"):
            tests.append(self._all())
        return tests[0] if len(tests) == 1 else self._meaning.any_of(tests)

    def _all(self) -> T:
        tests = [self.parse_with_nesting_limit(self._term)]
        while self.accept("and", "&&", ","):
            tests.append(self.parse_with_nesting_limit(self._term))
        return tests[0] if len(tests) == 1 else self._meaning.all_of(tests)

    def _term(self) -> T:
        if self.accept("not", "!"):
            return self._meaning.negation(self.parse_with_nesting_limit(self._term))
        if self.lookahead_word == "(" and not (self._sums and self._is_sum()):
            self.accept("(")
            inside = self._alternatives()
            self.close_group()
            return inside
        return self._read_single(self)

    def _is_sum(self) -> bool:
        """Whether the bracket that opens next is closed without a comparison or a negation in it."""
        depth = 0
        for word in reversed(self._words):
            depth += (word == "(") - (word == ")")
            if word in COMPARISONS or word.lower() in ("!", "not"):
                return False
            if depth == 0:
                return True
        return False
