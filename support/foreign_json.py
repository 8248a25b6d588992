"""Reads JSON of other programs, with what Python's reader lets through as errors."""

import json
from typing import Any

from support.diagnostics import LocatedError
from support.number_parsing import parse_number


def load_json(text: str) -> Any:
    """The value of a JSON text; NaN and infinity pass, as other programs write them.

    Raises ValueError, also for a text that is nested too deep, an integer beyond any float, and a name that occurs
    twice in an object, of which Python's reader silently takes the last.
    """
    try:
        return json.loads(text, parse_int=parse_number, object_pairs_hook=unique_names)
    except RecursionError:
        raise ValueError("it is nested too deep") from None


def load_json_of_file(text: str, name: str, error: type[LocatedError]) -> Any:
    """The value of the JSON of a file. Raises `error` that names it."""
    try:
        return load_json(text)
    except ValueError as wrong:
        raise error(f"not JSON: {wrong}", name) from None


def unique_names(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """The object of JSON with these names and values. Raises ValueError for a name that occurs twice."""
    found: dict[str, Any] = {}
    for name, value in pairs:
        if name in found:
            raise ValueError(f"{name!r} occurs twice in an object")
        found[name] = value
    return found
