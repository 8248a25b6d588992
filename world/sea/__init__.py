"""The sea bottom."""

from world.sea.bathymetry import Bathymetry, BathymetryError, read_bathymetry

__all__ = [
    "Bathymetry",
    "BathymetryError",
    "read_bathymetry",
]
