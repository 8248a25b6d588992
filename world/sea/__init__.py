"""The sea bottom, and what happens to a vehicle that touches it."""

from world.sea.bathymetry import Bathymetry, BathymetryError, read_bathymetry
from world.sea.grounding import Grounding

__all__ = [
    "Bathymetry",
    "BathymetryError",
    "Grounding",
    "read_bathymetry",
]
