"""Conditions of transitions: ManeuverIsDone, comparisons such as FuelLevel.value < 20, and, or, not."""

import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import imc
from imc.layout import NUMBERS

Latest = Mapping[type[imc.Message], imc.Message]
Test = Callable[[Latest, bool], bool]
DONE = ("", "true", "maneuverisdone", "maneuverisdone()")
LONGEST = 1000  # characters
DEEPEST = 50  # nested brackets and negations
_TOKEN = re.compile(
    r"\s*(?:(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)"
    r"|(?P<name>[A-Za-z_]\w*(?:\.\w+)?(?:\(\))?)|(?P<sign><=|>=|==|!=|<|>|&&|\|\||[!(),]))"
)
_COMPARISONS: Mapping[str, Callable[[float, float], bool]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "==": operator.eq,
    "!=": operator.ne,
}


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
    """Parse a condition. Raises ValueError with the reason."""
    if text.strip().lower() in DONE:
        return Condition(text, lambda _, done: done, frozenset())
    if len(text) > LONGEST:
        raise ValueError(f"has more than {LONGEST} characters")
    parser = _Parser(text)
    test = parser.alternatives()
    if parser.word is not None:
        raise ValueError(f"{parser.word!r} is not expected")
    return Condition(text, test, frozenset(parser.kinds))


def _message(name: str) -> type[imc.Message] | None:
    try:
        return imc.builtin()[name]
    except KeyError:
        return None


class _Parser:
    """Recursive descent; `word` is the next token, None at the end."""

    def __init__(self, text: str):
        self.kinds: set[type[imc.Message]] = set()
        self._words: list[str] = []
        self._depth = 0
        text, at = text.rstrip(), 0
        while at < len(text):
            found = _TOKEN.match(text, at)
            if found is None:
                raise ValueError(f"{text[at:].split()[0]!r} is not understood")
            self._words.append(found.group().strip())
            at = found.end()
        self._words.reverse()

    @property
    def word(self) -> str | None:
        return self._words[-1] if self._words else None

    def alternatives(self) -> Test:
        tests = [self._all()]
        while self._skip("or", "||"):
            tests.append(self._all())
        return tests[0] if len(tests) == 1 else lambda latest, done: any(test(latest, done) for test in tests)

    def _all(self) -> Test:
        tests = [self._single()]
        while self._skip("and", "&&", ","):
            tests.append(self._single())
        return tests[0] if len(tests) == 1 else lambda latest, done: all(test(latest, done) for test in tests)

    def _single(self) -> Test:
        self._depth += 1
        if self._depth > DEEPEST:
            raise ValueError(f"is nested more than {DEEPEST} times")
        test = self._term()
        self._depth -= 1
        return test

    def _term(self) -> Test:
        if self._skip("not", "!"):
            inner = self._single()
            return lambda latest, done: not inner(latest, done)
        if self._skip("("):
            inner = self.alternatives()
            if not self._skip(")"):
                raise ValueError("a ) is missing")
            return inner
        word = self._take("a condition")
        if word.lower() in DONE:
            return lambda _, done: done
        return self._comparison(word)

    def _comparison(self, word: str) -> Test:
        name, _, field = word.partition(".")
        kind = _message(name)
        if kind is None or not field:
            raise ValueError(f"{word!r} is neither ManeuverIsDone nor Message.field")
        if field not in {f.name for f in imc.fields(kind) if f.type.split()[0] in NUMBERS}:
            raise ValueError(f"{name} has no numeric field {field!r}")
        sign = self._take("a comparison")
        compare = _COMPARISONS.get(sign)
        if compare is None:
            raise ValueError(f"{sign!r} is not a comparison")
        try:
            limit = float(self._take("a number"))
        except ValueError:
            raise ValueError(f"{word} {sign} needs a number") from None
        self.kinds.add(kind)

        def test(latest: Latest, _: bool) -> bool:
            message = latest.get(kind)
            return message is not None and compare(getattr(message, field), limit)

        return test

    def _skip(self, *words: str) -> bool:
        found = bool(self._words) and self._words[-1].lower() in words
        if found:
            self._words.pop()
        return found

    def _take(self, what: str) -> str:
        if not self._words:
            raise ValueError(f"{what} is missing")
        return self._words.pop()
