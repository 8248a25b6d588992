"""Finds the tasks of a profile whose source makes a message, for an input that a log lacks."""

import ast
import sys
from collections.abc import Collection
from pathlib import Path
from typing import NamedTuple

from runtime.profile import Profile, split_list
from runtime.task import Task
from runtime.vehicle import TaskImportError, find_task

FOLLOWED = ("tasks.", "autonomy.navigation", "autonomy.plans")
DEEPEST = 2  # imports from the module of a task


def publishing_sections(profile: Profile, names: Collection[str]) -> dict[str, list[str]]:
    """Enabled sections, by name, whose task creates an object of that name, such as a message; none without any.

    What a task creates is read from its source: a task declares what it subscribes to, not what it publishes. A module
    without source counts as one that creates nothing.
    """
    selected = split_list(profile.config.value("General", "Selected"))
    found: dict[str, list[str]] = {}
    modules: dict[str, _Module] = {}
    for section in profile.config.sections if names else ():
        if not profile.is_task_enabled(section, selected):
            continue
        try:
            cls = find_task(section)
        except TaskImportError:
            continue
        created = _created_by(cls, modules) if cls is not None else set[str]()
        for name in created.intersection(names):
            found.setdefault(name, []).append(section)
    return found


class _Module(NamedTuple):
    """The names that the source of a module calls, and the modules that it imports from."""

    called: set[str]
    imports: list[str]


def _created_by(cls: type[Task], modules: dict[str, _Module]) -> set[str]:
    """The names of what the modules of a task and of its base classes create; `modules` keeps what is read."""
    created, seen = set[str](), set[str]()
    waiting = [(base.__module__, 0) for base in cls.__mro__ if issubclass(base, Task) and base is not Task]
    while waiting:
        name, depth = waiting.pop(0)
        if name in seen:
            continue
        seen.add(name)
        module = modules.get(name) or modules.setdefault(name, _read(name))
        created |= module.called
        if depth < DEEPEST:
            waiting += [(other, depth + 1) for other in module.imports]
    return created


def _read(name: str) -> _Module:
    path = getattr(sys.modules.get(name), "__file__", None)
    try:
        nodes = list(ast.walk(ast.parse(Path(path).read_bytes()))) if path is not None else []
    except (OSError, ValueError, SyntaxError):  # a module without source, such as a compiled one
        nodes = []
    imports = [node.module for node in nodes if isinstance(node, ast.ImportFrom) and node.module]
    called = {_called(node.func) for node in nodes if isinstance(node, ast.Call)}
    return _Module(called, [module for module in imports if module.startswith(FOLLOWED)])


def _called(function: ast.expr) -> str:
    """The class in `imc.Class(...)` or `Class(...)`."""
    if isinstance(function, ast.Attribute):
        return function.attr if isinstance(function.value, ast.Name) and function.value.id == "imc" else ""
    return function.id if isinstance(function, ast.Name) else ""
