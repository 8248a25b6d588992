"""The rules of the house that import-linter cannot check: faces, names, cycles, and who knows what."""

import ast
import builtins
import importlib
import pkgutil
import re
import subprocess
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from types import FunctionType

import grimp
import pytest

from runtime.vehicle import all_tasks
from support.top_level_packages import PACKAGES
from tests.outside import TOO_LARGE, largest_file

ROOT = Path(__file__).parent.parent
SOURCES = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
ROOMS = set(PACKAGES) | {
    found.name
    for package in PACKAGES
    for found in pkgutil.walk_packages([str(ROOT / package)], f"{package}.")
    if found.ispkg
}
FACES = {room for room in ROOMS if hasattr(importlib.import_module(room), "__all__")}
OPEN = {  # modules that are imported as they are
    *(
        "imc.console_acl",
        "imc.reserved_ids",
        "imc.console_links",
        "imc.discovery",
        "imc.fragments",
        "imc.layout",
        "imc.messages",
        "imc.tuple_list",
        "runtime.network_interfaces",
        "runtime.udp_sockets",
    ),
    "runtime.testing",
    *(f"shoal.logs.export.{form}" for form in ("mcap", "netcdf", "parquet", "csv", "llf")),  # need their libraries
    *("shoal.logs.edit.mcap_import", "shoal.logs.edit.tlog_import", "shoal.logs.edit.flight_log_import"),
    "tasks.vision.mug_detector",
    "runtime.vehicle.vehicle",  # files whose frames a traceback leaves out
    "runtime.kernel.kernel",
    "runtime.kernel.event_queue",
}
TASKS = all_tasks()
DUNES_NAMES = ROOT / "runtime" / "profile" / "dune_section_names.py"


@pytest.fixture(scope="module")
def trees():
    return {path: ast.parse(path.read_text()) for path in SOURCES}


def module_of(path):
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports(tree):
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module, [alias.name for alias in node.names]
        elif isinstance(node, ast.Import):
            yield from ((alias.name, []) for alias in node.names)


def room_of(module):
    """The innermost package that a module is in."""
    return module if module in ROOMS else module.rpartition(".")[0]


def test_a_room_is_entered_through_its_face(trees):
    wrong = []
    for path in SOURCES:
        here = room_of(module_of(path))
        for module, names in imports(trees[path]):
            room = room_of(module)
            inside = here == room or here.startswith(f"{room}.") or room.startswith(f"{here}.")
            if module.split(".")[0] not in PACKAGES or inside or room not in FACES or module in OPEN:
                continue
            if module != room:
                wrong.append(f"{path}: import this from {room}, or add it to the face of {room}: {module}")
                continue
            face = importlib.import_module(room)
            behind = [name for name in names if name not in face.__all__ and f"{module}.{name}" not in ROOMS | OPEN]
            wrong += [f"{path}: {room} does not export {name}" for name in behind]
    assert not wrong


def test_a_face_has_a_sentence_and_no_module_is_named_like_its_functions():
    for room in sorted(room for room in ROOMS if not room.startswith("tasks.")):
        face = importlib.import_module(room)
        assert (face.__doc__ or "").strip().split("\n")[0].endswith("."), room
        modules = {found.name for found in pkgutil.iter_modules(face.__path__)}
        functions = {n for n in getattr(face, "__all__", ()) if isinstance(getattr(face, n), FunctionType)}
        assert not functions & modules, f"{room}: functions and modules"


def texts_of(tree):
    """The strings of a module that are not docstrings."""
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    owners = [node for node in ast.walk(tree) if isinstance(node, documented) and ast.get_docstring(node)]
    docstrings = {id(node.body[0].value) for node in owners if isinstance(node.body[0], ast.Expr)}
    constants = (node for node in ast.walk(tree) if isinstance(node, ast.Constant) and id(node) not in docstrings)
    return [node.value for node in constants if isinstance(node.value, str)]


def test_the_runtime_names_no_task(trees):
    name = re.compile(rf"\b({'|'.join(map(re.escape, TASKS))})\b")
    paths = [path for path in (ROOT / "runtime").rglob("*.py") if path != DUNES_NAMES]
    assert not [(path, text) for path in paths for text in texts_of(trees[path]) if name.search(text)]


def test_only_mavlink_knows_pymavlink(trees):
    wrong = []
    for path in SOURCES:
        text = path.read_text()
        imported = [module for module, _ in imports(trees[path])] + re.findall(r"import_module\(\"([\w.]+)", text)
        if "mavutil" in text or any(module.split(".")[0] == "pymavlink" for module in imported):
            wrong += [path] if path.parent.name != "mavlink" else []
    assert not wrong


def test_documents_import_from_faces():
    faces, wrong = {*PACKAGES, *ROOMS, "runtime.testing"}, []
    for document in DOCUMENTS:
        blocks = re.findall(r"^```python[^\n]*\n(.*?)^```$", document.read_text(), re.MULTILINE | re.DOTALL)
        for module, names in (found for code in blocks for found in imports(ast.parse(code))):
            if module.split(".")[0] not in PACKAGES:
                continue
            face = importlib.import_module(module)
            missing = [name for name in names if name not in getattr(face, "__all__", dir(face))]
            wrong += [f"{document}: {module} is not a face"] if module not in faces else []
            wrong += [f"{document}: {module} does not export {missing}"] if missing else []
    assert not wrong


def test_no_file_is_longer_than_a_reader_understands_in_one_sitting():
    written = [*SOURCES, *(path for folder in ("bench", "tests") for path in (ROOT / folder).rglob("*.py"))]
    long = {path: n for path in written if (n := path.read_text().count("\n")) > 350}
    assert set(long) == {ROOT / "imc" / "messages.py"}, "only generated code is long"


# A program reports, receives, logs and sends. Names of others are left out: `[Zenoh] Hear`, a key, methods of files.
OF_PEOPLE = re.compile(
    r"(?<![A-Za-z])(?:tell|tells|told|telling|hear|hears|heard|hearing|believes?|believed|knows)(?![A-Za-z])"
)
OF_OTHERS = re.compile(r"\.tell\(|@heard|\bHEARD\b|\[Zenoh\] Hear|Zenoh:Hear|[.`\"]hear\b|\bhear:|\"Hear\"")


def test_programs_have_no_words_for_people():
    wrong = []
    for path in [path for path in SOURCES if path.name != "messages.py"]:
        for number, line in enumerate(path.read_text().split("\n"), 1):
            if found := OF_PEOPLE.search(OF_OTHERS.sub("", line).lower()):
                wrong.append(f"{path}:{number}: {found[0]}")
    assert not wrong


def test_what_a_face_exports_has_a_docstring(trees):
    exported = {name for face in FACES for name in importlib.import_module(face).__all__}
    defined = (ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    wrong = []
    for path in SOURCES:
        if path.name == "messages.py" or path.is_relative_to(ROOT / "tasks"):
            continue
        public = [node for node in trees[path].body if isinstance(node, defined) and node.name in exported]
        told = {node.name for node in public if ast.get_docstring(node)}  # of overloads one has it
        wrong += [f"{path}: {node.name}" for node in public if node.name not in told]
    assert not wrong


NAMED_BY = {
    **dict.fromkeys((ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.alias), "name"),
    **{ast.Name: "id", ast.Attribute: "attr", ast.arg: "arg", ast.keyword: "arg"},
}


def test_docstrings_name_what_exists(trees):
    """Also after a rename: errors, and names like `this_one`, which may be words of a string."""
    documentation, names, words = {}, set(dir(builtins)), set()
    for path, tree in trees.items():
        for node in ast.walk(tree):  # what is around a node comes before it
            if type(node) in NAMED_BY:
                names.add(getattr(node, NAMED_BY[type(node)]))
            elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
                documentation[node.value] = path
            elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node not in documentation:
                words.update(re.findall(r"\w+", node.value))
    wrong = []
    for node, path in documentation.items():
        text = str(node.value)
        missing = {error for error in re.findall(r"\b[A-Z]\w*(?:Error|InUse)\b", text) if error not in names}
        missing.update(set(re.findall(r"`([a-z0-9_]*_[a-z0-9_]+)`", text)) - names - words)
        wrong += [f"{path}:{node.lineno}: there is no {name}" for name in sorted(missing)]
    assert not wrong


def test_no_task_hands_on_its_publish(trees):
    """A fault stands before the method of one task: who keeps the method itself would not notice."""
    kept = []
    for path in [path for path in SOURCES if path.relative_to(ROOT).parts[0] == "tasks"]:
        called = {id(node.func) for node in ast.walk(trees[path]) if isinstance(node, ast.Call)}
        for node in ast.walk(trees[path]):
            if (
                isinstance(node, ast.Attribute)
                and node.attr in ("publish", "publish_frame")
                and isinstance(node.value, ast.Name)
                and node.value.id == "self"
                and isinstance(node.ctx, ast.Load)
                and id(node) not in called
            ):
                kept.append(f"{path}:{node.lineno}")
    assert not kept


# Functions whose last digit, or whose sequence, depends on the version of Python or NumPy, and what replaces them.
UNSTABLE = {
    "sum": "math.fsum; for integers, say so in a comment on the line: # integers",  # compensated since Python 3.12
    "fmean": "math.fsum",
    "sumprod": "math.fsum",
    "hash": "zlib.crc32",
    "shuffle": "self.random",
    "default_rng": "self.random",
}
COMPUTING = [
    path for path in SOURCES if path.relative_to(ROOT).parts[0] in ("autonomy", "mavlink", "support", "tasks", "world")
]
COMPUTING += sorted((ROOT / "imc" / "coordinates").glob("*.py"))


def test_what_vehicles_compute_does_not_depend_on_the_version_of_python(trees):
    wrong = []
    for path in COMPUTING:
        lines = path.read_text().split("\n")
        for node in ast.walk(trees[path]):
            if not isinstance(node, ast.Call):
                continue
            called = node.func.id if isinstance(node.func, ast.Name) else ""
            called = node.func.attr if isinstance(node.func, ast.Attribute) and node.func.attr != "sum" else called
            of_integers = called == "sum" and "# integers" in lines[node.lineno - 1]
            if called in UNSTABLE and not of_integers:
                wrong.append(f"{path}:{node.lineno}: {called} gives other results elsewhere; use {UNSTABLE[called]}")
    assert not wrong


def test_no_two_classes_have_the_same_name(trees):
    """Except tasks, whose names are those of sections, IMC's messages, and the notebook, whose names are given."""
    tasks = {(cls.__module__, cls.__name__) for cls in TASKS.values()}
    places = {}
    for path in SOURCES:
        if path.name == "messages.py" or path.is_relative_to(ROOT / "world" / "notebook"):
            continue
        for node in trees[path].body:
            if isinstance(node, ast.ClassDef) and node.name[0] != "_" and (module_of(path), node.name) not in tasks:
                places.setdefault(node.name, []).append(str(path.relative_to(ROOT)))
    assert not {name: found for name, found in places.items() if len(found) > 1}


CIRCLES = {  # imports that close a circle, and why; all but one are for types only, and not made when a program runs
    "imc.message -> imc.dict_codec": "methods of each message, imported when they are called",
    "imc.codec_compiler -> imc.message": "it compiles functions for messages, which need them to exist",
    "imc.schema.classes -> imc.schema.schema": "a class knows the schema that it was made for",
    "runtime.task.activation -> runtime.task.task": "a part of a task knows its task",
    "runtime.task.decorators -> runtime.task.task": "a part of a task knows its task",
    "runtime.task.logbook -> runtime.task.task": "a part of a task knows its task",
    "runtime.task.script -> runtime.task.task": "a part of a task knows its task",
    "runtime.task.task -> runtime.vehicle": "a task knows its vehicle",
    "runtime.task.devices -> runtime.vehicle": "a task knows its vehicle",
    "runtime.vehicle.fleet -> runtime.vehicle.vehicle": "a fleet joins vehicles, and a vehicle knows its fleet",
    "runtime.vehicle.parameter_service -> runtime.vehicle.vehicle": "a part of a vehicle knows its vehicle",
    "runtime.vehicle.realtime_lag -> runtime.vehicle.vehicle": "a part of a vehicle knows its vehicle",
    "runtime.vehicle.other_process_entities -> runtime.vehicle.vehicle": "a part of a vehicle knows its vehicle",
    "runtime.vehicle.vehicle -> runtime.snapshot": "it holds the journals of its run, for whoever saves it",
    "shoal.scenarios.run_context -> shoal.scenarios.links": "it holds the channels of links, which are made for a run",
}


def test_modules_import_each_other_in_a_circle_only_where_there_is_a_reason():
    graph = grimp.build_graph(*PACKAGES, cache_dir=None)
    imported = {
        module: {
            found for found in graph.find_modules_directly_imported_by(module) if f"{module} -> {found}" not in CIRCLES
        }
        for module in graph.modules
    }
    try:
        TopologicalSorter(imported).prepare()
    except CycleError as error:
        pytest.fail(f"a circle of imports: {' imports '.join(reversed(error.args[1]))}")


@pytest.mark.parametrize("script", sorted((ROOT / ".ci").iterdir()), ids=lambda path: path.name)
def test_paths_in_scripts_of_ci_exist(script):
    for path in re.findall(r"\b(?:tests|bench)/[\w./]*\w", script.read_text()):
        assert (ROOT / path).exists(), path


def test_files_of_others_stay_whole_while_a_test_limits_their_size(tmp_path):
    users = [path for path in (ROOT / "tests").rglob("*.py") if "RLIMIT_" + "FSIZE" in path.read_text()]
    assert users == [ROOT / "tests" / "outside.py"]
    (tmp_path / "module.py").write_text(f"words = {'x' * 5000!r}\n")
    command = [sys.executable, "-c", "import module, pathlib; pathlib.Path('file').write_text(module.words)"]
    with largest_file(1000):
        limited = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert TOO_LARGE in limited.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "module.py"]
    assert subprocess.run(command, cwd=tmp_path).returncode == 0
