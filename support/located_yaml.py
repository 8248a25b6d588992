"""Reads YAML into a tree with line numbers; the type of a value is chosen when it is read from the tree."""

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, cast

from support.diagnostics import LocatedError, Origin
from support.number_parsing import parse_number, require_float_range

if TYPE_CHECKING:
    import yaml  # slow to import, and most runs read no YAML

_DEEPEST = 16
_MOST = 200_000  # nodes
_LARGEST = 4 << 20  # bytes of a file
_QUOTED = re.compile(r"'[^']*'" r'|"(?:[^"\\]|\\.)*"')


class Node:
    """A scalar, list or mapping of a YAML file, with file and line. A scalar is `plain` if it has no quotes.

    Methods raise the error class given to `parse_yaml_tree`, naming file and line.
    """

    __slots__ = ("content", "error", "file", "line", "plain")

    def __init__(
        self,
        content: "str | list[Node] | dict[str, Node]",
        file: str,
        line: int,
        error: type[LocatedError] = LocatedError,
        plain: bool = False,
    ) -> None:
        self.content: str | list[Node] | dict[str, Node] = content
        self.file: str = file
        self.line: int = line
        self.error: type[LocatedError] = error
        self.plain: bool = plain

    @property
    def where(self) -> str:
        return f"{self.file}:{self.line}"

    def fail(self, reason: str) -> NoReturn:
        raise self.error(reason, self.where)

    def with_content(self, content: "str | list[Node] | dict[str, Node]", *, plain: bool = False) -> "Node":
        """Other content at the same place."""
        return Node(content, self.file, self.line, self.error, plain)

    def raw(self) -> Any:
        """The content with each scalar as the text that the file has."""
        if isinstance(self.content, dict):
            return {key: node.raw() for key, node in self.content.items()}
        return [node.raw() for node in self.content] if isinstance(self.content, list) else self.content

    def value(self) -> Any:
        """The content as YAML 1.1 types it: numbers, booleans, dates, None, text, lists, dictionaries.

        1e-3 is text there: it may be a name, and readers of numbers convert it.
        """
        if isinstance(self.content, dict):
            return {key: node.value() for key, node in self.content.items()}
        if isinstance(self.content, list):
            return [node.value() for node in self.content]
        if not self.plain:
            return self.content
        import yaml

        types = _types()
        tag: str = types.resolve(yaml.ScalarNode, self.content, (True, False))
        try:
            value = types.yaml_constructors[tag](types, yaml.ScalarNode(tag, self.content))
            return require_float_range(value) if isinstance(value, int) else value
        except (ValueError, KeyError, yaml.YAMLError):
            self.fail(f"{self.content!r} is not a value")

    def text(self) -> str:
        if not isinstance(self.content, str):
            self.fail("expected text")
        return self.content

    def written(self) -> object:
        """The value, but a number as the text that it is written as: 007 and 12:30 are names where a name belongs."""
        value = self.value()
        return self.content if isinstance(value, int | float) and not isinstance(value, bool) else value

    def integer(self) -> int:
        value = self.number()
        if not isinstance(value, int):
            self.fail(f"expected an integer, not {self.text()!r}")
        return value

    def number(self) -> int | float:
        try:
            return parse_number(self.text())
        except ValueError as wrong:
            self.fail(str(wrong))

    def flag(self) -> bool:
        if self.text() not in ("true", "false"):
            self.fail(f"expected true or false, not {self.text()!r}")
        return self.content == "true"

    def items(self) -> "list[Node]":
        if not isinstance(self.content, list):
            self.fail("expected a list")
        return self.content

    def texts(self) -> tuple[str, ...]:
        return tuple(item.text() for item in self.items())

    def mapping(self, *allowed: str, required: tuple[str, ...] = ()) -> "dict[str, Node]":
        """The mapping. Raises an error if a `required` key is missing, or a key is not `allowed` (empty: all are)."""
        if not isinstance(self.content, dict):
            self.fail("expected a mapping")
        for key, node in self.content.items():
            if allowed and key not in allowed:
                node.fail(f"unknown key {key!r} (known: {', '.join(allowed)})")
        for key in required:
            if key not in self.content:
                self.fail(f"{key!r} is missing")
        return self.content


@cache
def _types() -> Any:
    """A resolver that types scalars as YAML 1.1 does."""
    import yaml

    return yaml.SafeLoader("")


def read_text(path: Path, error: type[LocatedError]) -> str:
    """The text of a file of at most 4 MiB. Raises `error` that names the file, OSError if it cannot be read."""
    with path.open("rb") as file:  # a device or a pipe has no size
        content = file.read(_LARGEST + 1)
    if len(content) > _LARGEST:
        raise error(f"larger than {_LARGEST >> 20} MiB", path)
    try:
        return content.decode()
    except UnicodeDecodeError as wrong:
        raise error(f"not UTF-8: {wrong.reason} at byte {wrong.start}", path) from None


def parse_yaml_tree(text: str, file: str, error: type[LocatedError] = LocatedError) -> Node:
    """The one document in the text. Raises `error` naming file:line, also for anchors, tags and duplicate keys."""
    import yaml

    try:
        loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
        return _tree(cast(Any, yaml).parse(text, Loader=loader), file, error)
    except yaml.MarkedYAMLError as wrong:
        mark = wrong.problem_mark
        line, place = (mark.line + 1, mark.index) if mark else (1, 0)
        before = text[:place].rpartition("\n")[2]
        if _brackets(before) > _DEEPEST:  # PyYAML reads ahead in a line, and has a limit of its own
            raise error("nested too deeply", Origin(file, line)) from wrong
        tab = "; indent with spaces, not tabs" if text[place : place + 1] == "\t" and not before.strip() else ""
        raise error(f"not YAML: {wrong.problem}{tab}", Origin(file, line)) from wrong
    except yaml.YAMLError as wrong:
        raise error(f"not YAML: {str(wrong).splitlines()[0]}", file) from wrong


def _brackets(text: str) -> int:
    """Number of brackets that are open at the end of a part of a line."""
    unquoted = _QUOTED.sub("", text)
    return sum((letter in "[{") - (letter in "]}") for letter in unquoted)  # integers


def _tree(events: "Iterator[yaml.Event]", file: str, error: type[LocatedError]) -> Node:
    import yaml

    root = Node([], file, 1, error)
    open_nodes = [root]
    keys: list[Node | None] = [None]
    for number, event in enumerate(events):
        line = event.start_mark.line + 1
        if number > _MOST:
            raise error(f"more than {_MOST} values", Origin(file, line))
        if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None):
            raise error("anchors and aliases are not allowed", Origin(file, line))
        if (tag := cast(str | None, getattr(event, "tag", None))) not in (None, "!"):
            raise error(f"tags such as {tag!r} are not allowed", Origin(file, line))
        if isinstance(event, yaml.MappingEndEvent | yaml.SequenceEndEvent):
            open_nodes.pop()
            keys.pop()
            continue
        if isinstance(event, yaml.ScalarEvent):
            node = Node(event.value, file, line, error, plain=event.implicit[0])
        elif isinstance(event, yaml.MappingStartEvent):
            node = Node({}, file, line, error)
        elif isinstance(event, yaml.SequenceStartEvent):
            node = Node([], file, line, error)
        else:
            continue
        parent = open_nodes[-1].content
        if isinstance(parent, list):
            parent.append(node)
        elif isinstance(parent, dict):
            key = keys[-1]
            if key is None:
                if node.text() in parent:
                    raise error(f"{node.content!r} occurs twice", Origin(file, line))
                keys[-1] = node
                continue
            node.line = key.line
            parent[key.text()] = node
            keys[-1] = None
        if not isinstance(node.content, str):
            if len(open_nodes) > _DEEPEST:
                raise error("nested too deeply", Origin(file, line))
            open_nodes.append(node)
            keys.append(None)
    documents = root.items()
    if len(documents) != 1:
        reason = "expected one YAML document, not several" if documents else "the file is empty"
        raise error(reason, Origin(file, 1))
    return documents[0]
