"""The public interface is that of docs/public_interface.txt: a change shows in review, and goes into CHANGELOG.

`python -m tests.test_public_interface` writes the list anew.
"""

import enum
import importlib
import inspect
from functools import cached_property
from pathlib import Path
from types import GenericAlias
from typing import TypeVar

import imc
from imc import messages

LIST = Path(__file__).parent.parent / "docs" / "public_interface.txt"
MODULES = (
    "imc",
    "imc.coordinates",
    "imc.lsf",
    "imc.schema",
    "runtime",
    "runtime.bus",
    "runtime.devices",
    "runtime.kernel",
    "runtime.profile",
    "runtime.testing",
    "runtime.vehicle",
    "shoal",
    "shoal.missions",
    "shoal.network",
    "shoal.scenarios",
    "shoal.campaigns",
    "shoal.rerun",
    "autonomy.control",
    "autonomy.guidance",
    "autonomy.navigation",
    "autonomy.plans",
    "mavlink",
    "world",
    "world.bodies",
    "world.detection",
    "world.optics",
    "world.rendering",
    "world.sea",
    "world.sensors",
)


def parameters(callable_):
    """How it is called: names, which may be left out, which are keywords only; without annotations."""
    if inspect.isclass(callable_) and issubclass(callable_, Exception) and "__init__" not in vars(callable_):
        return ""
    try:
        signature = inspect.signature(callable_)
    except (TypeError, ValueError):
        return "(...)"
    bare = [
        each.replace(annotation=each.empty, default=each.empty if each.default is each.empty else None)
        for each in signature.parameters.values()
        if each.name not in ("self", "cls")
    ]
    return str(inspect.Signature(bare)).replace("=None", "=...")


def members(cls):
    for name, value in sorted(vars(cls).items()):
        if name.startswith("_") or isinstance(cls, enum.EnumMeta):
            continue
        if inspect.isfunction(value):
            yield f"    {name}{parameters(value)}"
        elif isinstance(value, classmethod | staticmethod):
            yield f"    {name}{parameters(value.__func__)}"
        elif isinstance(value, property | cached_property):
            yield f"    {name}"


def describe(module):
    faces = importlib.import_module(module)
    yield module
    for name in sorted(getattr(faces, "__all__", ()) or (n for n in vars(faces) if not n.startswith("_"))):
        value = getattr(faces, name)
        if isinstance(value, TypeVar) or (faces is imc and name in messages.__all__):
            continue
        if not hasattr(faces, "__all__") and getattr(value, "__module__", None) != module:
            continue
        if inspect.isclass(value) and not isinstance(value, GenericAlias):
            yield f"  class {name}" + ("" if isinstance(value, enum.EnumMeta) else parameters(value))
            yield from members(value)
        elif inspect.isroutine(value):
            yield f"  {name}{parameters(value)}"
        else:
            yield f"  {name}"


def listing():
    return "\n".join(line for module in MODULES for line in describe(module)) + "\n"


def test_the_public_interface_is_the_one_that_is_listed():
    assert listing() == LIST.read_text()


if __name__ == "__main__":
    LIST.write_text(listing())
