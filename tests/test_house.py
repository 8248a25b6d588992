"""The rules of the house that import-linter cannot check: faces, names, and who knows what."""

import ast
import importlib
import pkgutil
import re
from pathlib import Path
from types import FunctionType

import pytest

from runtime.vehicle import all_tasks

ROOT = Path(__file__).parent.parent
PACKAGES = ("imc", "mavlink", "runtime", "shoal", "tasks", "world")
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
        "imc.addresses",
        "imc.discovery",
        "imc.fragments",
        "imc.layout",
        "imc.messages",
        "imc.tuples",
        "runtime.problem",
        "runtime.durations",
        "runtime.networks",
    ),
    "runtime.testing",
    "world.attitude",
    *("imc.coordinates.arrays", "imc.schema.yamltree"),  # need NumPy and PyYAML, which are slow to import
    *(f"shoal.logs.export.{form}" for form in ("mcap", "netcdf", "parquet", "csv", "llf")),  # need their libraries
    *("shoal.logs.edit.mcap_import", "shoal.logs.edit.tlog_import", "shoal.logs.edit.flight_import"),
    "runtime.vehicle.vehicle",  # its file's name ends what is shown of a traceback
    "runtime.kernel.kernel",
}
TASKS = all_tasks()
DUNES_NAMES = ROOT / "runtime" / "profile" / "dune.py"


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


@pytest.mark.parametrize("path", SOURCES, ids=module_of)
def test_a_room_is_entered_through_its_face(path):
    here = room_of(module_of(path))
    for module, names in imports(ast.parse(path.read_text())):
        room = room_of(module)
        inside = here == room or here.startswith(f"{room}.") or room.startswith(f"{here}.")
        if module.split(".")[0] not in PACKAGES or inside or room not in FACES or module in OPEN:
            continue
        assert module == room, f"import this from {room}, or add it to the face of {room}: {module}"
        face = importlib.import_module(room)
        behind = [name for name in names if name not in face.__all__ and f"{module}.{name}" not in ROOMS | OPEN]
        assert not behind, f"{room} does not export {behind}"


@pytest.mark.parametrize("room", sorted(room for room in ROOMS if not room.startswith("tasks.")))
def test_a_face_has_a_sentence_and_no_module_is_named_like_its_functions(room):
    face = importlib.import_module(room)
    assert (face.__doc__ or "").strip().split("\n")[0].endswith(".")
    modules = {found.name for found in pkgutil.iter_modules(face.__path__)}
    for name in getattr(face, "__all__", ()):
        exported = getattr(face, name)
        assert not (isinstance(exported, FunctionType) and name in modules), f"{room}.{name} is a function and a module"


def texts_of(tree):
    """The strings of a module that are not docstrings."""
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    owners = [node for node in ast.walk(tree) if isinstance(node, documented) and ast.get_docstring(node)]
    docstrings = {id(node.body[0].value) for node in owners}
    constants = (node for node in ast.walk(tree) if isinstance(node, ast.Constant) and id(node) not in docstrings)
    return [node.value for node in constants if isinstance(node.value, str)]


@pytest.mark.parametrize("path", sorted((ROOT / "runtime").rglob("*.py")), ids=module_of)
def test_the_runtime_names_no_task(path):
    texts = texts_of(ast.parse(path.read_text()))
    named = [name for name in TASKS for text in texts if re.search(rf"\b{re.escape(name)}\b", text)]
    assert path == DUNES_NAMES or not named


@pytest.mark.parametrize("path", [path for path in SOURCES if path.parent.name != "mavlink"], ids=module_of)
def test_only_mavlink_knows_pymavlink(path):
    text = path.read_text()
    assert "mavutil" not in text
    imported = [module for module, _ in imports(ast.parse(text))] + re.findall(r"import_module\(\"([\w.]+)", text)
    assert not [module for module in imported if module.split(".")[0] == "pymavlink"]


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_documents_import_from_faces(document):
    faces = {*PACKAGES, *ROOMS, "runtime.testing"}
    for language, code in re.findall(r"^```(\w+)[^\n]*\n(.*?)^```$", document.read_text(), re.MULTILINE | re.DOTALL):
        if language != "python":
            continue
        for module, names in imports(ast.parse(code)):
            if module.split(".")[0] not in PACKAGES:
                continue
            assert module in faces, f"{module} is not a face"
            face = importlib.import_module(module)
            missing = [name for name in names if name not in getattr(face, "__all__", dir(face))]
            assert not missing, f"{module} does not export {missing}"


@pytest.mark.parametrize("path", [path for path in SOURCES if path.name != "messages.py"], ids=module_of)
def test_what_a_face_exports_has_a_docstring(path):
    exported = {name for face in FACES for name in importlib.import_module(face).__all__}
    defined = (ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    nodes = [node for node in ast.parse(path.read_text()).body if isinstance(node, defined)]
    public = [node for node in nodes if node.name in exported and not path.is_relative_to(ROOT / "tasks")]
    told = {node.name for node in public if ast.get_docstring(node)}  # of overloads one has it
    assert {node.name for node in public} <= told


# Functions whose last digit, or whose sequence, depends on the version of Python or NumPy, and what replaces them.
UNSTABLE = {
    "sum": "math.fsum; for integers, say so in a comment on the line: # integers",  # compensated since Python 3.12
    "fmean": "math.fsum",
    "sumprod": "math.fsum",
    "hash": "zlib.crc32",
    "shuffle": "self.random",
    "default_rng": "self.random",
}
COMPUTING = [path for path in SOURCES if path.relative_to(ROOT).parts[0] in ("mavlink", "tasks", "world")]
COMPUTING += sorted((ROOT / "imc" / "coordinates").glob("*.py"))


@pytest.mark.parametrize("path", COMPUTING, ids=module_of)
def test_what_vehicles_compute_does_not_depend_on_the_version_of_python(path):
    text = path.read_text()
    lines = text.split("\n")
    for node in ast.walk(ast.parse(text)):
        if not isinstance(node, ast.Call):
            continue
        called = node.func.id if isinstance(node.func, ast.Name) else ""
        called = node.func.attr if isinstance(node.func, ast.Attribute) and node.func.attr != "sum" else called
        of_integers = called == "sum" and "# integers" in lines[node.lineno - 1]
        if called in UNSTABLE and not of_integers:
            pytest.fail(f"{path}:{node.lineno}: {called} gives other results elsewhere; use {UNSTABLE[called]}")
