"""Reads YAML into a tree that remembers its lines; scalars stay text, so the reader of a key decides its type."""

from collections.abc import Iterator
from typing import Any, cast

import yaml

from imc.errors import SchemaError
from imc.schema.definition import parse_number

_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_DEEPEST = 16


class Node:
    """A scalar, list or mapping of a YAML file, with the place where it stands."""

    __slots__ = ("content", "file", "line")

    def __init__(self, content: "str | list[Node] | dict[str, Node]", file: str, line: int) -> None:
        self.content = content
        self.file = file
        self.line = line

    @property
    def where(self) -> str:
        return f"{self.file}:{self.line}"

    def text(self) -> str:
        if not isinstance(self.content, str):
            raise SchemaError(f"{self.where}: expected text")
        return self.content

    def integer(self) -> int:
        value = self.number()
        if not isinstance(value, int):
            raise SchemaError(f"{self.where}: expected an integer, not {self.text()!r}")
        return value

    def number(self) -> int | float:
        return parse_number(self.text(), self.where)

    def flag(self) -> bool:
        if self.text() not in ("true", "false"):
            raise SchemaError(f"{self.where}: expected true or false, not {self.text()!r}")
        return self.content == "true"

    def items(self) -> "list[Node]":
        if not isinstance(self.content, list):
            raise SchemaError(f"{self.where}: expected a list")
        return self.content

    def texts(self) -> tuple[str, ...]:
        return tuple(item.text() for item in self.items())

    def mapping(self, *allowed: str, required: tuple[str, ...] = ()) -> "dict[str, Node]":
        """The mapping; if keys are given, no others may occur. Raises SchemaError."""
        if not isinstance(self.content, dict):
            raise SchemaError(f"{self.where}: expected a mapping")
        for key, node in self.content.items():
            if allowed and key not in allowed:
                raise SchemaError(f"{node.where}: unknown key {key!r} (known: {', '.join(allowed)})")
        for key in required:
            if key not in self.content:
                raise SchemaError(f"{self.where}: {key!r} is missing")
        return self.content


def read_tree(text: str, file: str) -> Node:
    """The one document in the text. Raises SchemaError naming file:line; refuses anchors, tags and doubled keys."""
    try:
        return _tree(cast(Any, yaml).parse(text, Loader=_LOADER), file)
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        raise SchemaError(f"{file}:{line}: not YAML: {error.problem}") from error
    except yaml.YAMLError as error:
        raise SchemaError(f"{file}: not YAML: {error}") from error


def _tree(events: Iterator[yaml.Event], file: str) -> Node:
    root = Node([], file, 1)
    open_nodes = [root]
    keys: list[Node | None] = [None]
    for event in events:
        line = event.start_mark.line + 1
        if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None):
            raise SchemaError(f"{file}:{line}: anchors and aliases are not used here")
        if isinstance(event, yaml.MappingEndEvent | yaml.SequenceEndEvent):
            open_nodes.pop()
            keys.pop()
            continue
        if isinstance(event, yaml.ScalarEvent):
            node = Node(event.value, file, line)
        elif isinstance(event, yaml.MappingStartEvent):
            node = Node({}, file, line)
        elif isinstance(event, yaml.SequenceStartEvent):
            node = Node([], file, line)
        else:
            continue
        parent = open_nodes[-1].content
        if isinstance(parent, list):
            parent.append(node)
        elif isinstance(parent, dict):
            key = keys[-1]
            if key is None:
                if node.text() in parent:
                    raise SchemaError(f"{file}:{line}: {node.content!r} occurs twice")
                keys[-1] = node
                continue
            node.line = key.line
            parent[key.text()] = node
            keys[-1] = None
        if not isinstance(node.content, str):
            if len(open_nodes) > _DEEPEST:
                raise SchemaError(f"{file}:{line}: nested too deeply")
            open_nodes.append(node)
            keys.append(None)
    documents = root.items()
    if len(documents) != 1:
        raise SchemaError(f"{file}:1: expected one YAML document, not {len(documents)}")
    return documents[0]
