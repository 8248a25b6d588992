"""Conditions of transitions: ManeuverIsDone, comparisons such as FuelLevel.value < 20 %, and, or, not."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

import imc

LatestMessages: TypeAlias = Mapping[type[imc.Message], imc.Message]
Test = Callable[[LatestMessages, bool], bool]
DONE_WORDS = ("true", "maneuverisdone")


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
    """Parse a condition. Raises ValueError with the reason, and with the place of the mistake."""
    if text.strip().lower() in ("", *DONE_WORDS):
        return Condition(text, lambda _, done: done, frozenset())
    from autonomy.plans.condition_compiler import compile_test  # slow to import, and most plans have no comparisons

    test, kinds = compile_test(text, DONE_WORDS)
    return Condition(text, lambda latest, done: test([done, *map(latest.get, kinds)]), frozenset(kinds))
