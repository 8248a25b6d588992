"""Vehicle dynamics: underwater vehicles, boats, a multirotor, and motion without forces."""

from world.bodies.auv import DivergedError, UnderwaterVehicle
from world.bodies.auv_model import Fin, Thruster, UnderwaterModel, read_underwater_model
from world.bodies.boat import Boat
from world.bodies.boat_model import BoatModel, is_boat_model, is_estimated_model, read_boat_model
from world.bodies.model_section import ModelError
from world.bodies.multirotor import Airframe, Multirotor
from world.bodies.path_patterns import (
    CirclePattern,
    LegsPattern,
    LinePattern,
    MinimumJerkRamp,
    Pattern,
    lawn_mower_corners,
    parse_points,
)
from world.bodies.pattern_motion import PatternMotion
from world.bodies.wave_response import BoatMotion, motion_in_waves

__all__ = [
    "Airframe",
    "Boat",
    "BoatModel",
    "BoatMotion",
    "CirclePattern",
    "DivergedError",
    "Fin",
    "LegsPattern",
    "LinePattern",
    "MinimumJerkRamp",
    "ModelError",
    "Multirotor",
    "Pattern",
    "PatternMotion",
    "Thruster",
    "UnderwaterModel",
    "UnderwaterVehicle",
    "is_boat_model",
    "is_estimated_model",
    "lawn_mower_corners",
    "motion_in_waves",
    "parse_points",
    "read_boat_model",
    "read_underwater_model",
]
