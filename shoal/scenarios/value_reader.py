"""Reads the values of scenario files: times, numbers with units, names, texts for options of a profile."""

import math
import re
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Any, TypeVar

from autonomy.plans.yaml import parse_in_unit, parse_quantity, split_quantity
from runtime.task import Parameter
from support.durations import LONGEST, parse_duration
from support.located_yaml import Node
from support.terminal_text import with_suggestion

T = TypeVar("T")
_METERS = re.compile(r"\dm(?![a-z])|\d\s+m(?![a-z])")


def read_mapping(node: Node, *allowed: str, what: str = "key") -> dict[str, Node]:
    """The mapping, all of whose keys are allowed. Raises the error of the file."""
    if not isinstance(node.content, dict):
        node.fail("expected a mapping of names to values")
    for key, item in node.content.items():
        if key not in allowed:
            item.fail(with_suggestion(f"unknown {what} {key!r}", key, allowed))
    return node.content


def convert_node_value(node: Node, read: Callable[[Any], T]) -> T:
    """Convert the value by a function; its ValueError gets the place in the file."""
    value = node.value()
    try:
        return read(value)
    except node.error:
        raise
    except ValueError as error:
        node.fail(str(error))


def read_seconds(node: Node) -> float:
    """A time of at least 0: "90 s", "10 min", "1h30min", or a number in s."""
    return convert_node_value(node, _duration)


def read_number(node: Node, unit: str = "") -> float:
    """A number, or one with a unit that fits, in SI."""
    return convert_node_value(node, lambda value: parse_quantity(value, unit))


def read_option_number(node: Node, unit: str) -> float:
    """A number in the unit of an option of a profile."""
    return convert_node_value(node, lambda value: parse_in_unit(value, unit))


def convert_to_unit_of(parameter: Parameter, text: str) -> str:
    """The text of an option, with its numbers in the unit of the parameter. Raises ValueError if a unit does not fit.

    Texts that are no numbers with a unit stay as they are.
    """
    if not parameter.ignored_suffix(text):
        return text
    unit = "" if parameter.unit in ("1", "-") else parameter.unit
    numbers = [parse_in_unit(word, unit) for word in (text.split(",") if parameter.is_list else [text])]
    return ", ".join(repr(int(n)) if parameter.type is int and n.is_integer() else repr(n) for n in numbers)


def read_whole_number(node: Node) -> int:
    """A whole number, 0 or more."""
    value = node.value()
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        node.fail(f"expected a whole number, 0 or more, not {node.content!r}")
    return value


def read_nonempty_text(node: Node) -> str:
    """A text that is not empty."""
    if not isinstance(node.content, str) or not node.content.strip():
        node.fail("expected a text")
    return node.content.strip()


def read_choice(node: Node, words: Iterable[str], what: str) -> str:
    """One of some words."""
    found, words = read_nonempty_text(node), list(words)
    if found not in words:
        node.fail(with_suggestion(f"there is no {what} {found!r}", found, words))
    return found


def read_option_text(node: Node) -> str:
    """The text of an option: a scalar as it is written, the items of a list with commas."""
    if isinstance(node.content, str):
        value = node.value()
        return ("true" if value else "false") if isinstance(value, bool) else node.content
    if isinstance(node.content, list):
        return ", ".join(map(read_option_text, node.content))
    node.fail("expected a value or a list of values")


def _duration(value: Any) -> float:
    if isinstance(value, str):
        with suppress(ValueError):  # of what is no number
            number, unit = split_quantity(value)
            value = value if unit else number
    if isinstance(value, int | float) and not isinstance(value, bool):
        if not (math.isfinite(value) and value >= 0.0):
            raise ValueError(f"{value} is not a time")
        if value > LONGEST:
            raise ValueError(f"{value:g} s is longer than {LONGEST:g} s")
        return float(value)
    if _METERS.search(str(value)):
        raise ValueError(f"{value!r}: m is for meters; write min for minutes")
    return parse_duration(str(value))
