"""The grammar of tests: and, or, not and brackets around comparisons; what a comparison is, its user says."""

import operator
import re
from collections.abc import Callable, Mapping
from typing import Any, Generic, ParamSpec

P = ParamSpec("P")
LONGEST = 1000  # characters
DEEPEST = 50  # nested brackets and negations
COMPARISONS: Mapping[str, Callable[[Any, Any], bool]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "==": operator.eq,
    "!=": operator.ne,
}
MEANT = {"=>": ">=", "=<": "<=", "=": "==", "&": "and", "|": "or"}
NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
SIGN = r"<=|>=|==|!=|<|>|&&|\|\||[!(),]"


class Logic(Generic[P]):
    """Recursive descent over the words of a text; `word` is the next one, None at the end.

    `pattern` is what a word may be; `single` reads one comparison by means of `take` and `skip`, and returns its test.
    """

    def __init__(self, text: str, pattern: "re.Pattern[str]", single: "Callable[[Logic[P]], Callable[P, bool]]"):
        if len(text) > LONGEST:
            raise ValueError(f"has more than {LONGEST} characters")
        self._read_single = single
        self._words: list[str] = []
        self._depth = 0
        text, at = text.rstrip(), 0
        while at < len(text):
            found = pattern.match(text, at)
            if found is None:
                rest = text[at:].split()[0]
                meant = next((f"; write {right}" for wrong, right in MEANT.items() if rest.startswith(wrong)), "")
                raise ValueError(f"{rest!r} is not understood{meant}")
            self._words.append(found.group().strip())
            at = found.end()
        self._words.reverse()

    @property
    def word(self) -> str | None:
        return self._words[-1] if self._words else None

    def parse(self) -> Callable[P, bool]:
        """The test of the whole text. Raises ValueError with the reason."""
        test = self._alternatives()
        if self.word is not None:
            raise ValueError(f"{self.word!r} is not expected")
        return test

    def skip(self, *words: str) -> bool:
        """Whether the next word was one of these, which is then taken."""
        found = bool(self._words) and self._words[-1].lower() in words
        if found:
            self._words.pop()
        return found

    def take(self, what: str) -> str:
        if not self._words:
            raise ValueError(f"{what} is missing")
        return self._words.pop()

    def comparison(self) -> Callable[[Any, Any], bool]:
        sign = self.take("a comparison")
        if sign not in COMPARISONS:
            raise ValueError(f"{sign!r} is not a comparison")
        return COMPARISONS[sign]

    def _alternatives(self) -> Callable[P, bool]:
        tests = [self._all()]
        while self.skip("or", "||"):
            tests.append(self._all())

        def any_of(*args: P.args, **kwargs: P.kwargs) -> bool:
            return any(test(*args, **kwargs) for test in tests)

        return tests[0] if len(tests) == 1 else any_of

    def _all(self) -> Callable[P, bool]:
        tests = [self._single()]
        while self.skip("and", "&&", ","):
            tests.append(self._single())

        def all_of(*args: P.args, **kwargs: P.kwargs) -> bool:
            return all(test(*args, **kwargs) for test in tests)

        return tests[0] if len(tests) == 1 else all_of

    def _single(self) -> Callable[P, bool]:
        self._depth += 1
        if self._depth > DEEPEST:
            raise ValueError(f"is nested more than {DEEPEST} times")
        test = self._term()
        self._depth -= 1
        return test

    def _term(self) -> Callable[P, bool]:
        if self.skip("not", "!"):
            inner = self._single()

            def contrary(*args: P.args, **kwargs: P.kwargs) -> bool:
                return not inner(*args, **kwargs)

            return contrary
        if self.skip("("):
            inside = self._alternatives()
            if not self.skip(")"):
                raise ValueError("a ) is missing")
            return inside
        return self._read_single(self)
