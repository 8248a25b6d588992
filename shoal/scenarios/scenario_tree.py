"""A scenario file as a tree: its values have places, and can be replaced before it is read as a scenario."""

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, cast

from runtime.profile import load_profile
from shoal.scenarios.engine import dry_run
from shoal.scenarios.file_dependencies import ScenarioDependencies, normalized_absolute_path, profile_dependencies
from shoal.scenarios.includes import (
    INCLUDE,
    VARIANT,
    VARIANTS,
    IncludedFiles,
    merge_includes,
    merge_variant,
    read_scenario_tree,
    variant_names,
)
from shoal.scenarios.reader import ScenarioReader
from shoal.scenarios.relative_file_paths import relocate_tree
from shoal.scenarios.scenario import Scenario
from shoal.scenarios.scenario_profiles import ScenarioProfiles
from support.located_yaml import Node

KeyPath = tuple[str, ...]


def load_document(path: Path) -> "ScenarioDocument":
    """Read the tree of a scenario file. Raises ScenarioFileError, and OSError if it cannot be read."""
    return ScenarioDocument(path, read_scenario_tree(path))


class ScenarioDocument:
    """The tree of a scenario file. Profiles that it names are read once for all scenarios that it gives."""

    def __init__(self, path: Path, root: Node):
        self.path = path
        self._root = merge_includes(root, path)
        self._profiles = ScenarioProfiles(path.parent)

    @property
    def root(self) -> Node:
        """The whole tree."""
        return self._root

    @property
    def included_files(self) -> tuple[Path, ...]:
        """The files that it includes, also by way of others."""
        node = self._root.content.get(INCLUDE) if isinstance(self._root.content, dict) else None
        return node.paths if isinstance(node, IncludedFiles) else ()

    @property
    def variant_names(self) -> list[str]:
        """The variants to run: those of the file, or none if it has chosen one. Raises ScenarioFileError."""
        chosen = isinstance(self._root.content, dict) and VARIANT in self._root.content
        return [] if chosen else variant_names(self._root)

    def scalars_by_path(self) -> dict[str, Node]:
        """All scalars by their place: the keys on the way, and numbers in lists, joined with "/"."""
        found: dict[str, Node] = {}
        _collect(self._root, (), found)
        return found

    def scenario(self, values: Mapping[str, object] | None = None) -> Scenario:
        """The scenario with some values replaced, by place; a place below a mapping may be new.

        Numbers are in SI, or in the unit of a parameter. Raises ScenarioFileError naming the line of the value.
        """
        root, variant = self._changed(values or {})
        return ScenarioReader(root, self.path, self._profiles, variant).scenario()

    def changed_tree(self, values: Mapping[str, object], folder: Path) -> Node:
        """The tree with some values replaced, for a file in a folder: paths of plans and profiles begin there."""
        return relocate_tree(self._changed(values)[0], self.path.parent, folder)

    def current_value(self, place: str) -> object:
        """The value at a place: that of the file, or that of a parameter which the file does not set; None if unknown.

        A text that is a number is given as one.
        """
        if (node := self.scalars_by_path().get(place)) is not None:
            return node.value()
        for spec in self.scenario().vehicles:
            for start in ("vehicle/parameters/", f"vehicles/{spec.name}/parameters/"):
                if place.startswith(start):
                    section, _, option = place.removeprefix(start).rpartition("/")
                    text = self._profiles.effective_value(spec.profile, spec.name, section, option)
                    return None if text is None else Node(text, "", 0, plain=True).value()
        return None

    def dependencies(self, values: Mapping[str, object] | None = None) -> ScenarioDependencies:
        """Files of the scenario with these values, besides the file itself. Raises as `scenario` does."""
        found = ScenarioDependencies(frozenset(map(normalized_absolute_path, self.included_files)))
        for spec in self.scenario(values).vehicles:
            overrides = [setting.override_text for setting in spec.settings]
            profile = load_profile(spec.profile, (spec.folder,), vehicle=spec.name, overrides=overrides)
            found |= profile_dependencies(profile, spec.modes)
            if spec.plan_file is not None:
                found |= ScenarioDependencies(frozenset([normalized_absolute_path(spec.plan_file)]))
        return found

    def dry_run(self, values: Mapping[str, object] | None = None) -> None:
        """Make sure that the scenario can begin with these values. Raises ScenarioFileError like `scenario`."""
        dry_run(self.scenario(values))

    @property
    def digest(self) -> str:
        """SHA-256 of all that the scenario is made of: the values of the file, its plans and its profiles."""
        made = hashlib.sha256(repr(_without_include(self._root).raw()).encode())
        scenario = self.scenario()
        for spec in scenario.vehicles:
            made.update(repr((spec.name, spec.modes)).encode())
            made.update(self._profiles.dump(spec.profile, spec.name).encode(errors="surrogateescape"))
            if spec.plan is not None:
                made.update(spec.plan.replace(timestamp=0.0).to_json().encode())
        return made.hexdigest()

    def _changed(self, values: Mapping[str, object]) -> tuple[Node, str]:
        """The tree of the variant with values replaced, and the variant."""
        root = self._root
        if INCLUDE in {place.partition("/")[0] for place in values}:
            root.fail("include is not a value: what it names is read with the file")
        for place, value in values.items():
            if place.startswith(f"{VARIANTS}/"):
                root = _put(root, place.split("/"), value)
        root, variant = merge_variant(root, values)
        for place, value in values.items():
            if place != VARIANT and not place.startswith(f"{VARIANTS}/"):
                root = _put(root, place.split("/"), value)
        return _without_include(root), variant


def _without_include(root: Node) -> Node:
    if not isinstance(root.content, dict) or INCLUDE not in root.content:
        return root
    return root.with_content({key: item for key, item in root.content.items() if key != INCLUDE})


def _collect(node: Node, place: KeyPath, found: dict[str, Node]) -> None:
    if isinstance(node.content, str):
        found["/".join(place)] = node
        return
    items = node.content.items() if isinstance(node.content, dict) else enumerate(node.content)
    for key, item in items:
        _collect(item, (*place, str(key)), found)


def _put(node: Node, steps: Sequence[str], value: object) -> Node:
    """The tree with a value at a place. A key may itself have a "/", as the section Simulators.IMU/AHRS has."""
    if not steps:
        return _node(node, value)
    if isinstance(node.content, list):
        if not steps[0].isdecimal() or int(steps[0]) >= len(node.content):
            node.fail(f"there is no item {steps[0]!r}: it has {len(node.content)}")
        index = int(steps[0])
        return node.with_content([_put(n, steps[1:], value) if i == index else n for i, n in enumerate(node.content)])
    if not isinstance(node.content, dict):
        node.fail(f"has no {'/'.join(steps)}: it is a value")
    for count in range(len(steps), 0, -1):
        key = "/".join(steps[:count])
        if key in node.content:
            return node.with_content({**node.content, key: _put(node.content[key], steps[count:], value)})
    return node.with_content({**node.content, **_new(node, steps, value)})


def _new(node: Node, steps: Sequence[str], value: object) -> dict[str, Node]:
    """Keys that are missing below a mapping; of the parameters of a vehicle, all but the last word is the section."""
    if len(steps) == 1:
        return {steps[0]: _node(node, value)}
    if steps[0] != "parameters" and "." in steps[0]:
        return {"/".join(steps[:-1]): node.with_content({steps[-1]: _node(node, value)})}
    return {steps[0]: node.with_content(_new(node, steps[1:], value))}


def _node(where: Node, value: Any) -> Node:
    """A value as a node at the place of another one."""
    if isinstance(value, Mapping):
        items = cast(Mapping[Any, Any], value)
        return where.with_content({str(key): _node(where, item) for key, item in items.items()})
    if isinstance(value, list | tuple):
        return where.with_content([_node(where, item) for item in cast(list[Any], value)])
    if isinstance(value, str):
        return where.with_content(value)
    return where.with_content(_scalar(value), plain=True)


def _scalar(value: object) -> str:
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if not isinstance(value, int):
        value = float(cast(Any, value))
    text = repr(value)
    return text.replace("e", ".0e", 1) if "e" in text and "." not in text else text  # YAML needs the point
