"""What people use: missions, logs, re-simulation, and the command `shoal`."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from shoal.missions import Mission, Report, fly

__all__ = ["Mission", "Report", "fly"]


def __getattr__(name: str) -> Any:
    """Imported at first use, so that `shoal --help` need not wait for it."""
    if name in __all__:
        return getattr(import_module("shoal.missions"), name)
    raise AttributeError(f"module 'shoal' has no attribute {name!r}")
