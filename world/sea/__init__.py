"""The sea: its bottom, what happens to a vehicle that touches it, its water, and its waves."""

from world.sea.bathymetry import Bathymetry, BathymetryError, OffsetFunction, read_bathymetry, read_bathymetry_reference
from world.sea.seabed_contact import SeabedContact
from world.sea.water_types import KOSCHMIEDER_CONSTANT, WATER_TYPES, jerlov_colors, water_visibility
from world.sea.wave_statistics import USUAL_WAVE_HEIGHT, SeaState
from world.sea.wind_sea import WaveMotion, WindSea

__all__ = [
    "KOSCHMIEDER_CONSTANT",
    "USUAL_WAVE_HEIGHT",
    "WATER_TYPES",
    "Bathymetry",
    "BathymetryError",
    "OffsetFunction",
    "SeaState",
    "SeabedContact",
    "WaveMotion",
    "WindSea",
    "jerlov_colors",
    "read_bathymetry",
    "read_bathymetry_reference",
    "water_visibility",
]
