"""The sea bottom, and what happens to a vehicle that touches it."""

from world.sea.bathymetry import Bathymetry, BathymetryError, read_bathymetry
from world.sea.grounding import Grounding
from world.sea.seabed import OUT_OF_BOUNDS, SOUNDING_RADIUS, TIDE, read_seabed, seabed_in_use

__all__ = [
    "OUT_OF_BOUNDS",
    "SOUNDING_RADIUS",
    "TIDE",
    "Bathymetry",
    "BathymetryError",
    "Grounding",
    "read_bathymetry",
    "read_seabed",
    "seabed_in_use",
]
