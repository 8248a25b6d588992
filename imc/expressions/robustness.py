"""Margins of tests: a test is a function of the latest messages, true if its margin is above 0."""

import math
import sys
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

LatestMessages: TypeAlias = Sequence[Any]
"""The latest message of each selector, None if there is none yet."""

RobustnessFunction: TypeAlias = Callable[[LatestMessages, float], float]
"""The margin of a test of the latest message of each selector; a comparison with one that is missing has that of the
second argument: NaN if nothing is known of it, or -inf if it counts as false."""

TIE = math.ulp(0.0)  # the margin of a test that is just met; just missed, it is negative
NO_NUMBER = -sys.float_info.max  # the margin of a test of NaN


def comparison_robustness(compare: Callable[[Any, Any], bool], a: float, b: float) -> float:
    """The margin of a comparison of two numbers: how far they may move before it changes."""
    holds = compare(a, b)
    size = float(abs(a - b))
    if size == 0.0:
        size = TIE
    elif size != size:  # infinities of one sign are equal, anything else is no number
        size = TIE if a == b else math.inf if holds else -NO_NUMBER
    return size if holds else -size


def boolean_robustness(compare: Callable[[Any, Any], bool], a: object, b: object) -> float:
    """The margin of a comparison of what has no distance: names, texts, numbers of states."""
    return math.inf if compare(a, b) else -math.inf


def is_unknown(margin: float) -> bool:
    """Whether the margin is NaN because a message is missing. A value that is not a number has the margin NO_NUMBER."""
    return margin != margin


def displayable_margin(margin: float) -> float:
    """A margin for people: a tie is 0, that of what is no number is infinite."""
    return 0.0 if abs(margin) <= TIE else math.copysign(math.inf, margin) if abs(margin) == -NO_NUMBER else margin


def violation_text(margin: float, words: str) -> str:
    """Text of the margin by which a test has failed, after some words, or of a value that is no number."""
    if margin == NO_NUMBER:
        return ": a value is no number"
    return f", {words} {-displayable_margin(margin):.6g}" if -math.inf < margin <= 0.0 else ""


def conjunction(tests: Sequence[RobustnessFunction]) -> RobustnessFunction:
    def margin(latest: LatestMessages, unknown: float) -> float:
        least, doubt = math.inf, False
        for test in tests:
            found = test(latest, unknown)
            if found != found:
                doubt = True
            elif found < least:
                least = found
        return math.nan if doubt and least > 0.0 else least

    return margin


def disjunction(tests: Sequence[RobustnessFunction]) -> RobustnessFunction:
    def margin(latest: LatestMessages, unknown: float) -> float:
        most, doubt = -math.inf, False
        for test in tests:
            found = test(latest, unknown)
            if found != found:
                doubt = True
            elif found > most:
                most = found
        return math.nan if doubt and most <= 0.0 else most

    return margin


def negate(test: RobustnessFunction) -> RobustnessFunction:
    return lambda latest, unknown: -test(latest, unknown)


def negate_unless_nan(test: RobustnessFunction) -> RobustnessFunction:
    """The margin of an expectation that a test is not met: what is no number does not meet that, either."""

    def margin(latest: LatestMessages, unknown: float) -> float:
        found = test(latest, unknown)
        return found if found == NO_NUMBER else -found

    return margin
