"""Definitions in files: those that come with this package, and any others."""

from functools import cache
from pathlib import Path

from imc.errors import SchemaError
from imc.messages import BY_ID
from imc.schema import Schema
from imc.schema_yaml import read_yaml

_DEFINITIONS = Path(__file__).with_name("definitions")
_FILES = ("imc-5.4.31.yaml", "shoal.yaml")
_LARGEST = 1 << 24


def load(path: str | Path) -> Schema:
    """The definitions in a YAML file of our layout. Raises SchemaError naming file:line, OSError."""
    path = Path(path)
    with path.open("rb") as file:
        data = file.read(_LARGEST + 1)
    if len(data) > _LARGEST:
        raise SchemaError(f"{path}: larger than {_LARGEST} bytes")
    try:
        return read_yaml(data.decode("utf-8"), str(path))
    except UnicodeDecodeError as error:
        raise SchemaError(f"{path}: not UTF-8: {error}") from error


@cache
def builtin() -> Schema:
    """The schema of the classes in `imc.messages`: IMC and what Shoal adds to it."""
    base, *overlays = (load(_DEFINITIONS / name) for name in _FILES)
    for other in overlays:
        base = base.overlay(other)
    base.adopt(BY_ID)
    return base
