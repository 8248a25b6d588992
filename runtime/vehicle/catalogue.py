"""Finds the class of a section: Shoal's own tasks by path, a user's tasks by the name of their module."""

import importlib
import importlib.util
import pkgutil
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from runtime.task import Task

OWN = "tasks"
LIBRARIES = {"zenoh": "zenoh", "mavlink": "pymavlink", "vision": "PIL"}


class TaskImportError(ImportError):
    """The module of a section exists but cannot be imported, or the declaration of its task is invalid."""


@cache
def own_tasks() -> dict[str, str]:
    """The modules of Shoal's own tasks, at any depth, by the section's name in lower case."""
    folder = importlib.util.find_spec(OWN)
    found: dict[str, str] = {}
    for path in (folder.submodule_search_locations or []) if folder else []:
        for group in pkgutil.iter_modules([path]):
            if group.ispkg:
                for module in _modules(Path(path) / group.name, f"{OWN}.{group.name}"):
                    found[module.removeprefix(f"{OWN}.").replace("_", "").lower()] = module
    return found


def find_task(section: str) -> type[Task] | None:
    """The class of a section such as "Simulators.IMU/AHRS" or "my_tasks.Whistle"; None if there is none.

    Raises TaskImportError if its module cannot be imported, or the declaration of a parameter is invalid.
    """
    name = section.partition("/")[0]
    path, _, cls_name = name.rpartition(".")
    module = own_tasks().get(name.lower())
    users = path if all(part.isidentifier() for part in name.split(".")) else ""
    try:
        if module is None and users and _exists(users):
            module = users
        found = getattr(importlib.import_module(module), cls_name, None) if module else None
    except (Exception, SystemExit) as error:
        raise TaskImportError(f"{section}: module {module or users} cannot be imported: {error!r}") from error
    if not (isinstance(found, type) and issubclass(found, Task) and found is not Task):
        return None
    _check_declaration(section, found)
    return found


def all_tasks(broken: list[TaskImportError] | None = None) -> dict[str, type[Task]]:
    """The tasks in Shoal's own folders by section name.

    Failed imports are added to `broken`; without it TaskImportError is raised.
    """
    found: dict[str, type[Task]] = {}
    for module in own_tasks().values():
        wanted = module.rpartition(".")[2].replace("_", "")
        group = section_group(module)
        try:
            for name, value in _members(group, module).items():
                if isinstance(value, type) and issubclass(value, Task) and name.lower() == wanted:
                    _check_declaration(f"{group}.{name}", value)
                    found[f"{group}.{name}"] = value
        except TaskImportError as error:
            if broken is None:
                raise
            broken.append(error)
    return dict(sorted(found.items()))


def section_group(module: str) -> str:
    """The beginning of a section's name: Control.AUV for tasks.control.auv.attitude. Short words are acronyms."""
    return ".".join(
        part.upper() if len(part) <= 3 else "".join(word[:1].upper() + word[1:] for word in part.split("_"))
        for part in module.split(".")[1:-1]
    )


def section_name(cls: type[Task]) -> str:
    """The section name of a class in a profile."""
    parts = cls.__module__.split(".")
    if parts[0] == OWN and len(parts) > 2:
        return f"{section_group(cls.__module__)}.{cls.__name__}"
    return f"{cls.__module__}.{cls.__name__}"


def missing_extra(cls: type[Task]) -> str:
    """The extra that a task needs and that is not installed, else empty."""
    library = LIBRARIES.get(cls.requires)
    return cls.requires if library and importlib.util.find_spec(library) is None else ""


def _members(group: str, module: str) -> dict[str, object]:
    try:
        return vars(importlib.import_module(module))
    except (Exception, SystemExit) as error:
        raise TaskImportError(f"{group}: module {module} cannot be imported: {error!r}") from error


def _check_declaration(section: str, cls: type[Task]) -> None:
    try:
        cls.parameters()
    except Exception as error:
        raise TaskImportError(f"{section} has an invalid declaration: {error}") from error


def _modules(folder: Path, package: str) -> Iterator[str]:
    for module in pkgutil.iter_modules([str(folder)]):
        name = f"{package}.{module.name}"
        if module.ispkg:
            yield from _modules(folder / module.name, name)
        else:
            yield name


def _exists(module: str) -> bool:
    if module.split(".")[0] in (OWN, "imc", "mavlink", "runtime", "shoal", "world"):
        return False
    try:
        return importlib.util.find_spec(module) is not None
    except ModuleNotFoundError as error:
        if error.name is not None and f"{module}.".startswith(f"{error.name}."):
            return False
        raise
    except ValueError:
        return False
