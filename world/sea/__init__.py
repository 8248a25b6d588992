"""The sea: its bottom, what happens to a vehicle that touches it, its water, and its waves."""

from world.sea.bathymetry import Bathymetry, BathymetryError, Offset, read_bathymetry, read_reference
from world.sea.seabed_contact import Grounding
from world.sea.water_types import CONTRAST_LEFT, WATER_TYPES, jerlov, visibility
from world.sea.waves import USUAL_HEIGHT, Waves
from world.sea.wind_sea import Ride, WindSea

__all__ = [
    "CONTRAST_LEFT",
    "USUAL_HEIGHT",
    "WATER_TYPES",
    "Bathymetry",
    "BathymetryError",
    "Grounding",
    "Offset",
    "Ride",
    "Waves",
    "WindSea",
    "jerlov",
    "read_bathymetry",
    "read_reference",
    "visibility",
]
