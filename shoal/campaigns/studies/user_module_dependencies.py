"""Finds the modules of a user that others import, without importing any."""

import ast
import importlib
import sys
import sysconfig
from collections.abc import Iterable, Iterator
from pathlib import Path

import runtime
from support.top_level_packages import PACKAGES, TASKS

LIBRARIES = ("site-packages", "dist-packages")  # also those of a user and of Debian
SHOAL = Path(runtime.__file__).resolve().parent.parent
OF_SHOAL = frozenset(PACKAGES) - {TASKS}


def find_user_modules(names: Iterable[str]) -> dict[str, tuple[Path, Path]]:
    """Modules of a user among these names and all that they import, with the folder and the file of each.

    What is installed, or in Shoal, is left out. Imports count wherever they stand, also within functions; a module
    that is imported by a name that a program makes is not found.
    """
    roots = list(dict.fromkeys(_roots()))
    found: dict[str, tuple[Path, Path]] = {}
    waiting, seen = sorted(names), set[str]()
    while waiting:
        name = waiting.pop()
        if name in seen:
            continue
        seen.add(name)
        for module, root, file in _files(name, roots):
            if module not in found:
                found[module] = root, file
                waiting += _imports(module, file)
    return dict(sorted(found.items()))


def _roots() -> Iterator[Path]:
    """The folders in which Python and Shoal search for a user's modules."""
    installed = {Path(path).resolve() for key, path in sysconfig.get_paths().items() if "lib" in key}
    for place in sys.path:
        folder = Path(place).resolve()
        if folder.name in LIBRARIES or any(folder.is_relative_to(lib) for lib in installed):
            continue
        if folder.is_dir():
            yield folder
    yield from (Path(place).resolve().parent for place in importlib.import_module(TASKS).__path__)


def _files(name: str, roots: Iterable[Path]) -> Iterator[tuple[str, Path, Path]]:
    """The file of a module and those of the packages that it is in, each with its name and its root."""
    parts = name.split(".")
    if parts[0] in OF_SHOAL or parts[0] in sys.stdlib_module_names or not all(part.isidentifier() for part in parts):
        return
    for root in roots:
        if parts[0] == TASKS and root == SHOAL:
            if _file(root, parts):
                return
            continue
        if _file(root, parts):
            for count in range(1, len(parts) + 1):
                file = _file(root, parts[:count])
                if file is not None:
                    yield ".".join(parts[:count]), root, file
            return


def _file(root: Path, parts: list[str]) -> Path | None:
    place = root.joinpath(*parts)
    return next((file for file in (place / "__init__.py", place.with_suffix(".py")) if file.is_file()), None)


def _imports(module: str, file: Path) -> Iterator[str]:
    """The names of what a module imports; of `from a import b` both a and a.b, since b may be a module."""
    try:
        tree = ast.parse(file.read_bytes())
    except (OSError, SyntaxError, ValueError):  # its import will report it
        return
    package = module if file.name == "__init__.py" else module.rpartition(".")[0]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield from _prefixes(alias.name)
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: max(0, len(package.split(".")) - node.level + 1)] if node.level else []
            base = ".".join([*above, *([node.module] if node.module else [])])
            yield from _prefixes(base)
            yield from (f"{base}.{alias.name}" for alias in node.names)


def _prefixes(name: str) -> Iterator[str]:
    parts = name.split(".")
    return (".".join(parts[:count]) for count in range(1, len(parts) + 1))
