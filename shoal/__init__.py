"""Missions, running vehicles, logs, re-simulation, and the command `shoal`."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from shoal.missions import Mission, Report, fly
    from shoal.network import NetworkError, connect

__all__ = ["Mission", "NetworkError", "Report", "connect", "fly"]

PACKAGES = ("missions", "network")
NETWORK = ("NetworkError", "connect")


def __getattr__(name: str) -> Any:
    """Import missions and networks at first use, so that `shoal --help` starts fast."""
    if name in __all__:
        return getattr(import_module("shoal.network" if name in NETWORK else "shoal.missions"), name)
    if name in PACKAGES:
        return import_module(f"shoal.{name}")
    raise AttributeError(f"module 'shoal' has no attribute {name!r}")
