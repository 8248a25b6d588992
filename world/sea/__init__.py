"""The sea: its bottom, what happens to a vehicle that touches it, and its waves."""

from world.sea.bathymetry import Bathymetry, BathymetryError, Offset, read_bathymetry, read_reference
from world.sea.grounding import Grounding
from world.sea.waves import USUAL_HEIGHT, Waves

__all__ = [
    "USUAL_HEIGHT",
    "Bathymetry",
    "BathymetryError",
    "Grounding",
    "Offset",
    "Waves",
    "read_bathymetry",
    "read_reference",
]
