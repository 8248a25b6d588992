"""The scenario of a study: its file, or what a study's file has inside, with distributions in place of values."""

import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

from shoal.campaigns.sampling.distributions import is_distribution, parse_distribution
from shoal.scenarios import ScenarioDependencies, ScenarioFileError, merge_includes
from support.located_yaml import Node, parse_yaml_tree, read_text


class EditableScenario(Protocol):
    """Interface that a study needs of a draft."""

    @property
    def digest(self) -> str: ...
    def scalars_by_path(self) -> Mapping[str, Node]: ...
    def scenario(self, values: Mapping[str, object] | None = ...) -> Any: ...
    def current_value(self, place: str) -> object: ...
    def dependencies(self, values: Mapping[str, object] | None = ...) -> ScenarioDependencies: ...
    def dry_run(self, values: Mapping[str, object] | None = ...) -> None: ...


D = TypeVar("D", bound=EditableScenario)
DraftFactory = Callable[[Path, Node], EditableScenario]
"""Makes the draft of a file from its tree, as `ScenarioDocument` does."""


@dataclass(frozen=True)
class ScenarioTemplate(Generic[D]):
    """A scenario whose distributions are replaced by a value of each, and these distributions by their place."""

    draft: D
    distributions: dict[str, Node]


def load_template(path: Path, make: Callable[[Path, Node], D]) -> ScenarioTemplate[D]:
    """Read a scenario's file, or the scenario inside a study's file.

    Raises ScenarioFileError with file and line, and OSError if it cannot be read.
    """
    root = parse_yaml_tree(read_text(path, ScenarioFileError), str(path), ScenarioFileError)
    if isinstance(root.content, dict) and isinstance((inside := root.content.get("scenario", root)).content, dict):
        root = inside
    root = merge_includes(root, path)
    found: dict[str, Node] = {}
    return ScenarioTemplate(make(path, _plain(root, (), found)), found)


def describe_value_error(draft: EditableScenario, values: Mapping[str, object], error: Exception) -> str:
    """The error of a draft with values of `--set`, which names the wrong value and not a line that is right.

    If the file is wrong by itself, or no single value is wrong, the error as it is.
    """
    with suppress(ValueError, LookupError):
        draft.scenario()
        for place, value in values.items():
            try:
                draft.scenario({place: value})
            except (ValueError, LookupError) as wrong:
                node = draft.scalars_by_path().get(place)
                line = re.escape(node.where) if node is not None else r".*?:\d+"
                return f"--set {place}={value}: {re.sub(f'^{line}: ', '', str(wrong))}"
    return str(error)


def _plain(node: Node, place: tuple[str, ...], found: dict[str, Node]) -> Node:
    if place == ("include",):  # files that were read, and no value
        return node
    if is_distribution(node):
        found["/".join(place)] = node
        made = parse_distribution(node)
        value = made.append_unit(made.quantiles([0.5])[0])
        plain = not isinstance(value, str)
        text = str(value).lower() if isinstance(value, bool) else value if isinstance(value, str) else repr(value)
        return node.with_content(text, plain=plain)
    if isinstance(node.content, dict):
        inside = {key: _plain(item, (*place, key), found) for key, item in node.content.items()}
        return node.with_content(inside)
    if isinstance(node.content, list):
        items = [_plain(item, (*place, str(number)), found) for number, item in enumerate(node.content)]
        return node.with_content(items)
    return node
