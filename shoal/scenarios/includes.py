"""Includes and variants of scenario files: trees that are merged, by one rule."""

import re
from collections.abc import Mapping
from pathlib import Path

from runtime.profile import resolve_root_copy
from shoal.scenarios.relative_file_paths import relocate_tree
from shoal.scenarios.scenario import ScenarioFileError
from support.located_yaml import Node, parse_yaml_tree, read_text
from support.terminal_text import with_suggestion

INCLUDE, VARIANT, VARIANTS = "include", "variant", "variants"
OWN = ("scenario", "description", INCLUDE)
"""Keys that a file does not take over from those that it includes."""

LISTS = ("events", "expect", "links")
"""Lists whose items are added to those before; one with the same name replaces."""

_VARIANT_NAME = re.compile(r"\w[\w.+-]*")


class IncludedFiles(Node):
    """Marker for merged includes of a file: `paths` are those of all files that were read."""

    __slots__ = ("paths",)

    def __init__(self, where: Node, paths: tuple[Path, ...]):
        super().__init__([], where.file, where.line, where.error)
        self.paths: tuple[Path, ...] = paths


def read_scenario_tree(path: Path) -> Node:
    """The tree of a scenario file, with what it includes. Raises ScenarioFileError, OSError if it cannot be read."""
    text = read_text(path, ScenarioFileError)
    try:
        root = parse_yaml_tree(text, str(path), ScenarioFileError)
    except ScenarioFileError as error:
        hint = " (a text with [, ], {, } or : in it needs quotes)" if "not YAML" in error.reason else ""
        raise ScenarioFileError(f"{error.reason}{hint}", error.where) from None
    return merge_includes(root, path)


def merge_includes(root: Node, path: Path) -> Node:
    """The tree of a file with those of the files that it includes, which were before. Raises ScenarioFileError."""
    return _merge_includes(with_whole_calls(root), path, (path.resolve(),))


def _merge_includes(root: Node, path: Path, above: tuple[Path, ...]) -> Node:
    if not isinstance(root.content, dict) or INCLUDE not in root.content:
        return root
    wanted = root.content[INCLUDE]
    if isinstance(wanted, IncludedFiles):
        return root
    names = wanted.items() if isinstance(wanted.content, list) else [wanted]
    merged = root.with_content({})
    read: list[Path] = []
    for name in names:
        file = resolve_root_copy(path.parent / name.text())
        if file.resolve() in above:
            name.fail(f"{name.text()} includes itself" + (", by way of others" if len(above) > 1 else ""))
        included = _read_included(name, file, (*above, file.resolve()))
        if isinstance(more := included.mapping().get(INCLUDE), IncludedFiles):
            read += more.paths
        read.append(file)
        own = {key: item for key, item in included.mapping().items() if key not in OWN}
        part = included.with_content(own)
        if file.parent.resolve() != path.parent.resolve():
            part = relocate_tree(part, file.parent, path.parent)
        merged = merge_trees(merged, part)
    rest = {key: item for key, item in root.content.items() if key != INCLUDE}
    found = merge_trees(merged, root.with_content(rest))
    files = IncludedFiles(wanted, tuple(dict.fromkeys(read)))
    return root.with_content({INCLUDE: files, **found.mapping()})


def _read_included(name: Node, file: Path, above: tuple[Path, ...]) -> Node:
    if not file.is_file():
        known = [found.name for found in sorted(file.parent.glob("*.yaml"))]
        name.fail(with_suggestion(f"there is no file {name.text()!r}", name.text(), known))
    try:
        text = read_text(file, ScenarioFileError)
    except OSError as error:
        name.fail(f"{file}: {error.strerror or error}")
    root = with_whole_calls(parse_yaml_tree(text, str(file), ScenarioFileError))
    return _merge_includes(root, file, above)


def merge_trees(base: Node, over: Node) -> Node:
    """Merge `over` into `base`: mappings are merged, lists of `LISTS` added, everything else is replaced.

    null takes something away.
    """
    return _merge_mappings(base, over, LISTS)


def _merge_mappings(base: Node, over: Node, lists: tuple[str, ...] = ()) -> Node:
    content = dict(base.mapping())
    for key, item in over.mapping().items():
        before = content.get(key)
        if before is not None and item.plain and item.content in ("null", "~"):
            del content[key]
        elif before is None:
            content[key] = item
        elif key in lists and isinstance(before.content, list) and isinstance(item.content, list):
            content[key] = item.with_content(_merge_items(before.content, item.content))
        elif isinstance(before.content, dict) and isinstance(item.content, dict):
            content[key] = _merge_mappings(before, item)
        else:
            content[key] = item
    return over.with_content(content)


def _merge_items(base: list[Node], over: list[Node]) -> list[Node]:
    found = list(base)
    places = {name: place for place, item in enumerate(base) if (name := _name(item))}
    for item in over:
        name = _name(item)
        if name in places:
            found[places[name]] = item
        else:
            found.append(item)
    return found


def _name(item: Node) -> str:
    name = item.content.get("name") if isinstance(item.content, dict) else None
    return name.content if name is not None and isinstance(name.content, str) else ""


def variant_names(root: Node) -> list[str]:
    """The variants that a tree has. Raises ScenarioFileError for a name that cannot be one."""
    node = root.content.get(VARIANTS) if isinstance(root.content, dict) else None
    if node is None:
        return []
    for name, item in node.mapping().items():
        if not _VARIANT_NAME.fullmatch(name):
            item.fail(f"{name!r} cannot be the name of a variant: letters, digits, and . + - _ behind the first")
    return list(node.mapping())


def merge_variant(root: Node, values: Mapping[str, object]) -> tuple[Node, str]:
    """The tree with its variant merged, and the name of that, empty if there is none.

    It is that of `values`, else that of the file. Raises ScenarioFileError.
    """
    if not isinstance(root.content, dict):
        return root, ""
    names, given = variant_names(root), root.content.get(VARIANT)
    chosen = values.get(VARIANT, given.text() if given is not None else "")
    chosen = str(chosen) if isinstance(chosen, int) else chosen  # of a study, for which 1 is a number
    rest = {key: item for key, item in root.content.items() if key not in (VARIANT, VARIANTS)}
    bare = root.with_content(rest)
    if chosen == "" or chosen is None:
        return bare, ""
    if chosen not in names:
        where = given or root.content.get(VARIANTS) or root
        where.fail(
            with_suggestion(f"there is no variant {chosen!r}", str(chosen), names) if names else "has no variants"
        )
    variant = root.content[VARIANTS].mapping()[str(chosen)]
    for key, item in variant.mapping().items():
        if key in (INCLUDE, VARIANT, VARIANTS):
            item.fail(f"{key} belongs to the file, not to a variant")
    return root.with_content(merge_trees(bare, variant).content), str(chosen)


def with_whole_calls(node: Node) -> Node:
    """Join texts that YAML has cut at commas within braces: {max: distance(A, B)}."""
    if isinstance(node, IncludedFiles):
        return node
    if isinstance(node.content, list):
        return node.with_content([with_whole_calls(item) for item in node.content])
    if not isinstance(node.content, dict):
        return node
    found: dict[str, Node] = {}
    open_key = ""
    for key, item in node.content.items():
        before = found.get(open_key)
        if before is not None and item.plain and item.content == "":
            assert isinstance(before.content, str)
            found[open_key] = before.with_content(f"{before.content}, {key}", plain=before.plain)
        else:
            found[key] = item = with_whole_calls(item)
            open_key = key
        text = found[open_key].content
        if not (isinstance(text, str) and text.count("(") > text.count(")")):
            open_key = ""
    return node.with_content(found)
