"""Several processes that belong together: those of one vehicle, or of a fleet."""

from shoal.fleet.keeper import Child, Keeper

__all__ = [
    "Child",
    "Keeper",
]
