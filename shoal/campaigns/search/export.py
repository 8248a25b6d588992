"""Writes what a search has found as files that other commands read: a scenario, and options of a profile."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from shoal.campaigns.jobs import SCENARIO_SUFFIX
from shoal.campaigns.sampling import load_template
from shoal.scenarios import ScenarioDocument
from support.atomic_files import replace_file
from support.located_yaml import Node
from support.terminal_text import printable

WIDTH = 110
_YAML: Any = yaml
_TYPES: Any = yaml.SafeLoader("")
_MAP, _SEQ, _STR = (f"tag:yaml.org,2002:{kind}" for kind in ("map", "seq", "str"))


def write_scenario(path: Path, values: Mapping[str, object], folder: Path, words: list[str]) -> Path:
    """Write the scenario in a file, or in that of a study, with other values, by place; and return the new file.

    `words` are comments at its top. It is called as the other, since plans within it are, too. Raises OSError.
    """
    draft = load_template(path, ScenarioDocument).draft
    name = path.name.removesuffix(".yaml").removesuffix(".scenario").removesuffix(".study")
    target = folder / f"{name}{SCENARIO_SUFFIX}"
    _write(target, _comments(words) + to_yaml(draft.changed_tree(values, folder)))
    return target


def write_tuned_options(path: Path, values: Mapping[str, object], folder: Path, words: list[str]) -> list[Path]:
    """Write those values that are parameters as options of a profile, in a file for each vehicle. Raises OSError."""
    draft = load_template(path, ScenarioDocument).draft
    actors = draft.scenario(values).vehicles
    written: list[Path] = []
    for actor in actors:
        starts = ("vehicle/parameters/", f"vehicles/{actor.name}/parameters/")
        chosen = {place.removeprefix(start) for place in values for start in starts if place.startswith(start)}
        sections: dict[str, list[str]] = {}
        for setting in actor.settings:
            place = f"{setting.section}/{setting.option}"
            if any(name == place or name.startswith(f"{place}/") for name in chosen):  # also an item of a list
                sections.setdefault(setting.section, []).append(f"{setting.option} = {setting.value}")
        if sections:
            blocks = [f"[{section}]\n" + "\n".join(lines) + "\n" for section, lines in sections.items()]
            written.append(folder / ("tuned.ini" if len(actors) == 1 else f"tuned-{actor.name}.ini"))
            others = tuple(f"vehicles/{other.name}/" for other in actors if other is not actor)
            own = [line for line in words if not line.startswith(others)]
            _write(written[-1], _comments(own) + "\n".join(blocks))
    return written


def to_yaml(root: Node) -> str:
    """A tree as YAML that reads as the same tree."""
    made = _node(root, is_root=True)
    return str(_YAML.serialize(made, Dumper=yaml.SafeDumper, width=WIDTH, allow_unicode=True))


def _node(node: Node, *, is_root: bool = False) -> Any:
    if isinstance(node.content, str):
        tag = _TYPES.resolve(yaml.ScalarNode, node.content, (True, False)) if node.plain else _STR
        return yaml.ScalarNode(tag, node.content)
    if isinstance(node.content, list):
        items = [_node(item) for item in node.content]
        inline = all(isinstance(item.content, str) for item in node.content)
        return yaml.SequenceNode(_SEQ, items, flow_style=inline and _length(node) <= WIDTH)
    pairs = [(yaml.ScalarNode(_STR, key), _node(item)) for key, item in node.content.items()]
    return yaml.MappingNode(_MAP, pairs, flow_style=not is_root and _length(node) <= WIDTH)


def _length(node: Node) -> int:
    """Approximate length of a node in one line."""
    if isinstance(node.content, str):
        return len(node.content) + 4
    if isinstance(node.content, list):
        return 2 + sum(map(_length, node.content))  # integers
    return 2 + sum(len(key) + 2 + _length(item) for key, item in node.content.items())  # integers


def _comments(words: list[str]) -> str:
    return "".join(f"# {printable(line)}\n" for text in words for line in text.splitlines())


def _write(path: Path, text: str) -> None:
    with replace_file(path) as file:
        file.write(text.encode("utf-8", "surrogateescape"))
