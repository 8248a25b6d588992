"""Conditions of transitions: ManeuverIsDone, comparisons such as FuelLevel.value < 20, and, or, not."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

import imc
from autonomy.plans.boolean_grammar import NUMBER_PATTERN, SIGN_PATTERN, GrammarParser, predicate_connectives
from imc.layout import NUMBERS

LatestMessages: TypeAlias = Mapping[type[imc.Message], imc.Message]
Test = Callable[[LatestMessages, bool], bool]
DONE_WORDS = ("", "true", "maneuverisdone", "maneuverisdone()")
_WORD = re.compile(rf"\s*(?:{NUMBER_PATTERN}|[A-Za-z_]\w*(?:\.\w+)?(?:\(\))?|{SIGN_PATTERN})")


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
    if text.strip().lower() in DONE_WORDS:
        return Condition(text, lambda _, done: done, frozenset())
    kinds: set[type[imc.Message]] = set()

    def read_comparison(parser: GrammarParser[Test]) -> Test:
        word = parser.expect_word("a condition")
        return (lambda _, done: done) if word.lower() in DONE_WORDS else _comparison(word, parser, kinds)

    test = GrammarParser[Test](text, _WORD, read_comparison, predicate_connectives()).parse()
    return Condition(text, test, frozenset(kinds))


def _message(name: str) -> type[imc.Message] | None:
    try:
        return imc.builtin()[name]
    except KeyError:
        return None


def _comparison(word: str, parser: GrammarParser[Test], kinds: set[type[imc.Message]]) -> Test:
    name, _, field = word.partition(".")
    kind = _message(name)
    if kind is None or not field:
        raise ValueError(f"{word!r} is neither ManeuverIsDone nor Message.field")
    if field not in {f.name for f in imc.fields(kind) if f.type.split()[0] in NUMBERS}:
        raise ValueError(f"{name} has no numeric field {field!r}")
    sign = parser.lookahead_word
    compare = parser.expect_comparison()
    try:
        limit = float(parser.expect_word("a number"))
    except ValueError:
        raise ValueError(f"{word} {sign} needs a number") from None
    kinds.add(kind)

    def test(latest: LatestMessages, _: bool) -> bool:
        message = latest.get(kind)
        return message is not None and compare(getattr(message, field), limit)

    return test
