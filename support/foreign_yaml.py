"""Reads YAML of other programs, with what PyYAML's reader lets through as errors."""

from typing import Any, cast

import yaml


class _UniqueKeyLoader(yaml.SafeLoader):
    """Rejects a key that occurs twice in a mapping, of which PyYAML silently takes the last."""

    def compose_mapping_node(self, anchor: Any) -> yaml.MappingNode:
        node = super().compose_mapping_node(anchor)  # as it is written: construction merges other mappings (<<) into it
        seen = set[tuple[str, str]]()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode):
                name = key.tag, cast(str, key.value)  # pyright: ignore[reportUnknownMemberType]
                if name in seen:
                    raise yaml.MarkedYAMLError(problem=f"{key.value!r} occurs twice", problem_mark=key.start_mark)
                seen.add(name)
        return node


def load_yaml(text: str) -> Any:
    """The value of a YAML text of plain values. Raises yaml.YAMLError, also for a key that occurs twice."""
    return yaml.load(text, Loader=_UniqueKeyLoader)
