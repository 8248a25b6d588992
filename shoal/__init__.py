"""Missions, logs, re-simulation, and the command `shoal`."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from shoal.missions import Mission, Report, fly

__all__ = ["Mission", "Report", "fly"]


def __getattr__(name: str) -> Any:
    """Import missions at first use, so that `shoal --help` starts fast."""
    if name in __all__:
        return getattr(import_module("shoal.missions"), name)
    raise AttributeError(f"module 'shoal' has no attribute {name!r}")
