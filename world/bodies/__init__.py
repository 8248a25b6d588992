"""Vehicle dynamics: underwater vehicles, boats, a multirotor, and motion without forces."""

from world.bodies.auv import Diverged, UnderwaterVehicle
from world.bodies.auv_model import Fin, Thruster, UnderwaterModel, read_underwater_model
from world.bodies.boat import Boat
from world.bodies.boat_model import BoatModel, estimated, is_boat, read_boat_model
from world.bodies.model_section import ModelError
from world.bodies.multirotor import Airframe, Multirotor
from world.bodies.pattern_motion import Motion
from world.bodies.trajectory import Circle, Legs, Line, Pattern, Ramp, lawn_mower, parse_points
from world.bodies.wave_response import Riding, ride

__all__ = [
    "Airframe",
    "Boat",
    "BoatModel",
    "Circle",
    "Diverged",
    "Fin",
    "Legs",
    "Line",
    "ModelError",
    "Motion",
    "Multirotor",
    "Pattern",
    "Ramp",
    "Riding",
    "Thruster",
    "UnderwaterModel",
    "UnderwaterVehicle",
    "estimated",
    "is_boat",
    "lawn_mower",
    "parse_points",
    "read_boat_model",
    "read_underwater_model",
    "ride",
]
