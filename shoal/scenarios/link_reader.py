"""Reads the links of a scenario file."""

from collections.abc import Callable, Mapping
from dataclasses import fields
from types import MappingProxyType

import imc
from shoal.scenarios.links import LinkModel
from shoal.scenarios.value_reader import (
    read_choice,
    read_mapping,
    read_nonempty_text,
    read_number,
    read_option_number,
    read_seconds,
    read_whole_number,
)
from support.located_yaml import Node

_MAY_BE_ZERO = ("range", "latency", "loss")


def read_links(node: Node, schemas: Mapping[str, imc.Schema]) -> tuple[LinkModel, ...]:
    """The links in a file; `schemas` are those of the vehicles, by name. Raises the error of the file."""
    found: dict[str, LinkModel] = {}
    for item in node.items():
        link = _link(item, schemas)
        if link.name in found:
            item.fail(f"there are two links {link.name!r}: give each a name of its own")
        found[link.name] = link
    return tuple(found.values())


def _link(node: Node, schemas: Mapping[str, imc.Schema]) -> LinkModel:
    parts = read_mapping(node, "between", *(one.name for one in fields(LinkModel) if one.name != "ends"))
    if "between" not in parts:
        node.fail("'between' is missing: the names of two or more vehicles")
    ends = tuple(read_choice(item, schemas, "vehicle") for item in parts["between"].items())
    if len(set(ends)) < len(ends) or len(ends) < 2:
        parts["between"].fail("a link is between two or more vehicles")
    values = {key: read(parts[key]) for key, read in _NUMBERS.items() if key in parts}
    for key, value in values.items():
        if not (value > 0.0 or (value == 0.0 and key in _MAY_BE_ZERO)):
            parts[key].fail(f"{key} must be {'at least' if key in _MAY_BE_ZERO else 'above'} 0")
    names = {name for end in ends for name in schemas[end].types}
    return LinkModel(
        read_nonempty_text(parts["name"]) if "name" in parts else "-".join(ends),
        ends,
        **values,
        **({"queue": read_whole_number(parts["queue"])} if "queue" in parts else {}),
        messages=tuple(read_choice(item, names, "message") for item in parts["messages"].items())
        if "messages" in parts
        else (),
    )


def _share(node: Node) -> float:
    value = read_number(node, "%") / (100.0 if "%" in node.text() else 1.0)
    if value > 1.0:
        node.fail("a loss is from 0 to 1, or from 0 % to 100 %")
    return value


_NUMBERS: Mapping[str, Callable[[Node], float]] = MappingProxyType(
    {
        "range": lambda node: read_number(node, "m"),
        "latency": read_seconds,
        "propagation": lambda node: read_number(node, "m/s"),
        "loss": _share,
        "rate": lambda node: read_option_number(node, "B/s"),
    }
)
