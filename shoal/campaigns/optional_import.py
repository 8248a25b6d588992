"""Imports libraries that only campaigns need, when they are needed."""

from importlib import import_module
from typing import Any


def import_optional(name: str, extra: str = "campaigns") -> Any:
    """A module of an extra. Raises ModuleNotFoundError with the command that installs it."""
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        missing = (error.name or name).partition(".")[0]
        raise ModuleNotFoundError(f"this needs {missing}: pip install 'shoal[{extra}]'", name=missing) from None
