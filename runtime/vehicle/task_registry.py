"""Finds the class of a section: tasks in folders `tasks` by path, other tasks of a user by the name of their module."""

import importlib
import importlib.util
import re
import sys
import traceback
from collections.abc import Collection, Iterator
from filecmp import cmp
from functools import cache
from pathlib import Path
from types import ModuleType

from runtime.profile import dune_section_names
from runtime.task import Task, format_exception_line
from support.terminal_text import corrected_spelling, nearest_word, printable, quoted
from support.top_level_packages import PACKAGES, TASKS

MARK = Path("runtime/vehicle/task_registry.py")  # a folder that has this file is a clone of Shoal
SHORTEST = 3  # letters that can mean a longer name
LIBRARIES: dict[str, tuple[str, ...]] = {
    "zenoh": ("zenoh",),
    "mavlink": ("pymavlink",),
    "vision": ("PIL",),
    "drivers": ("serial",),
    "ftp": ("pyftpdlib",),
    "console": ("starlette", "uvicorn", "websockets"),  # some of them are in many environments
}


class TaskImportError(ImportError):
    """The module of a section exists but cannot be imported, or the declaration of its task is invalid."""


def add_task_folder(folder: Path) -> list[str]:
    """Search a folder for a user's tasks, after Shoal's: its modules, and its folder `tasks` by path.

    Returns what cannot be found there, because Shoal has the same name.
    """
    folder = folder.resolve()
    if str(folder) not in sys.path:
        sys.path.append(str(folder))
    importlib.invalidate_caches()
    package = importlib.import_module(TASKS)
    own = [Path(place).resolve() for place in package.__path__]
    if folder / TASKS in own:
        return []
    clashes = _other_sources(folder) if (folder / MARK).is_file() else _clashes(folder)
    if (folder / TASKS).is_dir():
        _extend(package, folder / TASKS)
        task_modules.cache_clear()
    return clashes


def _clashes(folder: Path) -> list[str]:
    """The packages and tasks of a user's folder that are not found, because Shoal has the same name."""
    clashes = [
        f"{path}: {quoted(name)} is a package of Shoal, so nothing in yours can be imported; rename it"
        for name in PACKAGES
        if name != TASKS
        for path in (folder / name, folder / f"{name}.py")
        if path.is_file() or any(path.glob("*.py"))
    ]
    before = task_modules()
    for module, file in _modules(folder / TASKS, TASKS):
        short = _section_key(module)
        if short in before:
            clashes.append(f"{file}: Shoal has a task in {before[short].replace('.', '/')}.py; rename yours")
    return clashes


def _other_sources(checkout: Path) -> list[str]:
    """Warnings about a clone of Shoal that is not the Shoal that runs; nothing if both are the same."""
    installed = Path(__file__).parents[len(MARK.parts) - 1]
    files = [file.relative_to(checkout) for name in PACKAGES for file in checkout.glob(f"{name}/**/*.py")]
    changed = sorted(
        file for file in files if (installed / file).is_file() and not cmp(installed / file, checkout / file, False)
    )
    if not changed:
        return []
    count = f"{len(changed)} files differ, such as" if len(changed) > 1 else "this file differs:"
    return [
        f"{checkout}: the Shoal that runs is the one in {installed}, not this clone; {count} {changed[0]}; "
        "to run the clone: pip install -e ."
    ]


def _extend(package: ModuleType, folder: Path) -> None:
    """Let a package of Shoal also have the modules of a user's folder of the same name, at any depth."""
    package.__path__.append(str(folder))
    for inner in sorted(path for path in folder.iterdir() if path.is_dir()):
        name = f"{package.__name__}.{inner.name}"
        if any((Path(place) / inner.name / "__init__.py").is_file() for place in package.__path__[:-1]):
            _extend(importlib.import_module(name), inner)


@cache
def task_modules() -> dict[str, str]:
    """The modules in folders `tasks`, at any depth, by the section's name in lower case; Shoal's come first."""
    folder = importlib.util.find_spec(TASKS)
    found: dict[str, str] = {}
    for path in (folder.submodule_search_locations or []) if folder else []:
        for module, _ in _modules(Path(path), TASKS):
            found.setdefault(_section_key(module), module)
    return found


def _snake_case(name: str) -> str:
    return re.sub(r"(?<=[a-z\d])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()


def _section_key(module: str) -> str:
    return module.removeprefix(f"{TASKS}.").replace("_", "").lower()


def find_task(section: str) -> type[Task] | None:
    """The class of a section such as "Simulators.IMU/AHRS" or "my_tasks.Whistle"; None if there is none.

    Raises TaskImportError if its module cannot be imported, or the declaration of a parameter is invalid.
    """
    module, cls_name = _module_of(section)
    found = _member(section, module, cls_name) if module else None
    if not (isinstance(found, type) and issubclass(found, Task) and found is not Task):
        return None
    _check_declaration(section, found)
    return found


def missing_task_reason(section: str) -> str:
    """Reason why `find_task` finds nothing for a section: a spelling mistake, or an error in its module or class."""
    if near := suggest_task_name(section):
        return f"did you mean [{near}]?"
    module, cls_name = _module_of(section)
    if not module:
        return _no_module(section.partition("/")[0].split("."))
    found = _member(section, module, cls_name)
    file = printable(sys.modules[module].__file__ or module)
    if found is not None:
        hint = f": write class {cls_name}(Task)" if isinstance(found, type) else ""
        return f"{cls_name} in {file} is not a Task{hint}"
    tasks = [
        name
        for name, value in vars(sys.modules[module]).items()
        if isinstance(value, type) and issubclass(value, Task) and value is not Task
    ]
    near = nearest_word(cls_name, tasks)
    hint = f"; did you mean {near}?" if near else f"; it has {', '.join(tasks)}" if tasks else ""
    return f"{file} has no class {cls_name}{hint}"


def _no_module(names: list[str]) -> str:
    """The places where the task of a section, by its parts, was searched for; or the name that it has to have."""
    inside = names[0].lower() == TASKS
    path = names[inside:]
    if inside and len(path) > 2 and ".".join(path[:-1]).replace("_", "").lower() in task_modules():
        del path[-2]  # the module, as Python names a class
    if len(path) < 2:
        inside, path = True, ["Mine", *path]
    file = printable("/".join(map(_snake_case, (TASKS, *path))))
    if inside:
        return f"write [{'.'.join(path)}] for the class {path[-1]} in {file}.py"
    module = quoted(".".join(path[:-1]))
    return f"there is no module {module} and no {file}.py where tasks are searched for; see --code"


def nearest_task(name: str, known: Collection[str]) -> str:
    """The one of the `known` tasks that is meant by a misspelled name; empty if none is close.

    It is one of the same group, if that exists: names differ less within a group than between a group's. A name that
    only one of them begins with means this one: Sensors.SBE49 is Sensors.SBE49FastCAT.
    """
    group, dot, rest = name.casefold().partition(".")
    inside = {task.partition(".")[2]: task for task in known if not dot or task.casefold().startswith(f"{group}.")}
    if not inside:
        return corrected_spelling(name, known)
    if near := corrected_spelling(rest or group, inside):
        return inside[near]
    begun = [task for short, task in inside.items() if len(rest) >= SHORTEST and short.casefold().startswith(rest)]
    return begun[0] if len(begun) == 1 else ""


def suggest_task_name(section: str) -> str:
    """The name of the task, of Shoal, the user or DUNE, that a section almost has; empty if it is not close to any."""
    name = section.partition("/")[0]
    near = (
        nearest_task(name, [*task_modules(), *dune_section_names.TASKS]) if name.lower() not in task_modules() else ""
    )
    if (module := task_modules().get(near)) is None:
        return near
    wanted = near.rpartition(".")[2]
    try:
        members = _members(module_section_group(module), module)
    except TaskImportError:  # reported once it is spelled rightly
        members = {}
    return f"{module_section_group(module)}.{next((word for word in members if word.lower() == wanted), wanted)}"


def _module_of(section: str) -> tuple[str, str]:
    """The module of a section, empty if there is none, and the name of the class in it."""
    name = section.partition("/")[0]
    path, _, cls_name = name.rpartition(".")
    module = task_modules().get(name.lower())
    if module is None and path and all(part.isidentifier() for part in name.split(".")):
        try:
            module = path if _exists(path) else None
        except (Exception, SystemExit) as error:
            raise TaskImportError(f"{section}: module {path} cannot be imported: {_error_text(error)}") from error
    return module or "", cls_name


def _member(section: str, module: str, cls_name: str) -> object:
    try:
        return getattr(importlib.import_module(module), cls_name, None)
    except (Exception, SystemExit) as error:
        raise TaskImportError(f"{section}: module {module} cannot be imported: {_error_text(error)}") from error


def all_tasks(broken: list[TaskImportError] | None = None) -> dict[str, type[Task]]:
    """The tasks in Shoal's own folders by section name.

    Failed imports are added to `broken`; without it TaskImportError is raised.
    """
    found: dict[str, type[Task]] = {}
    for module in task_modules().values():
        wanted = module.rpartition(".")[2].replace("_", "")
        group = module_section_group(module)
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


def module_section_group(module: str) -> str:
    """The beginning of a section's name: Control.AUV for tasks.control.auv.attitude. Short words are acronyms."""
    return ".".join(
        part.upper() if len(part) <= 3 else "".join(word[:1].upper() + word[1:] for word in part.split("_"))
        for part in module.split(".")[1:-1]
    )


def section_name(cls: type[Task]) -> str:
    """The section name of a class in a profile."""
    parts = cls.__module__.split(".")
    if parts[0] == TASKS and len(parts) > 2:
        return f"{module_section_group(cls.__module__)}.{cls.__name__}"
    return f"{cls.__module__}.{cls.__name__}"


def missing_extra(cls: type[Task]) -> str:
    """The extra that a task needs and that is not installed, else empty."""
    libraries = LIBRARIES.get(cls.requires, ())
    return cls.requires if any(importlib.util.find_spec(each) is None for each in libraries) else ""


def _members(group: str, module: str) -> dict[str, object]:
    try:
        return vars(importlib.import_module(module))
    except (Exception, SystemExit) as error:
        raise TaskImportError(f"{group}: module {module} cannot be imported: {_error_text(error)}") from error


def _check_declaration(section: str, cls: type[Task]) -> None:
    try:
        cls.parameters()
    except Exception as error:
        raise TaskImportError(f"{section} has an invalid declaration: {error}") from error


def _modules(folder: Path, package: str) -> Iterator[tuple[str, Path]]:
    """The modules below a folder, in folders of its own, with their files."""
    for file in sorted(folder.glob("*/**/*.py")):
        parts = file.relative_to(folder).with_suffix("").parts
        if parts[-1] != "__init__" and all(part.isidentifier() for part in parts):
            yield ".".join((package, *parts)), file


def _error_text(error: BaseException) -> str:
    """An error during an import, with the place in the user's code."""
    if isinstance(error, SyntaxError):
        return f"{error.filename}:{error.lineno}: SyntaxError: {error.msg}"
    words = format_exception_line(error) if isinstance(error, Exception) else repr(error)
    frames = traceback.extract_tb(error.__traceback__)
    places = [f for f in frames if not f.filename.startswith("<frozen") and f.filename != __file__]
    return f"{places[-1].filename}:{places[-1].lineno}: {words}" if places else words


def _exists(module: str) -> bool:
    if module.split(".")[0] in (*PACKAGES, *sys.stdlib_module_names):
        return False  # nothing there is a task, and an import can do anything: antigravity opens a browser
    try:
        return importlib.util.find_spec(module) is not None
    except ModuleNotFoundError as error:
        if error.name is not None and f"{module}.".startswith(f"{error.name}."):
            return False
        raise
    except ValueError:
        return False
