"""Files that a scenario names, when the scenario itself is written to another folder."""

import os
from pathlib import Path

from support.located_yaml import Node


def relocate_tree(root: Node, old: Path, new: Path) -> Node:
    """The tree of a scenario in the folder `old` as one in the folder `new`: the files that it names stay the same."""
    if not isinstance(root.content, dict):
        return root
    found = dict(root.content)
    if "vehicle" in found:
        found["vehicle"] = _vehicle(found["vehicle"], old, new)
    if "vehicles" in found:
        many = found["vehicles"]
        content = {name: _vehicle(item, old, new) for name, item in many.mapping().items()}
        found["vehicles"] = many.with_content(content)
    if "world" in found:
        found["world"] = _world(found["world"], old, new)
    if isinstance(found.get("variants"), Node) and isinstance(found["variants"].content, dict):
        many = found["variants"]
        content = {name: relocate_tree(item, old, new) for name, item in many.mapping().items()}
        found["variants"] = many.with_content(content)
    return root.with_content(found)


def _world(node: Node, old: Path, new: Path) -> Node:
    bathymetry = node.content.get("bathymetry") if isinstance(node.content, dict) else None
    if not isinstance(node.content, dict) or bathymetry is None or not isinstance(bathymetry.content, dict):
        return node
    chart = bathymetry.content.get("chart")
    if chart is None or not isinstance(chart.content, str) or not (path := old / chart.content.strip()).exists():
        return node
    content = {**bathymetry.content, "chart": _relative(path, new, chart)}
    moved = bathymetry.with_content(content)
    return node.with_content({**node.content, "bathymetry": moved})


def _relative(path: Path, new: Path, item: Node) -> Node:
    """The path from the new folder, in the place of a node."""
    text = Path(os.path.relpath(path.resolve(), new.resolve())).as_posix()
    return item.with_content(text)


def _vehicle(node: Node, old: Path, new: Path) -> Node:
    if not isinstance(node.content, dict):
        return node
    found = dict(node.content)
    for key in ("profile", "plan"):
        item = found.get(key)
        if item is None or not isinstance(item.content, str):
            continue
        text = item.content.strip()
        path = old / (text if key == "plan" or text.endswith(".ini") else f"{text}.ini")
        if key == "plan" or path.exists():
            found[key] = _relative(path, new, item)
    return node.with_content(found)
