"""How vehicles move: underwater vehicles, boats, a multirotor, and motion without forces."""

from world.bodies.auv import Craft, Diverged
from world.bodies.auv_model import Engine, Fin, Model, read_model
from world.bodies.boat import Boat
from world.bodies.boat_model import SurfaceModel, is_boat, read_surface_model
from world.bodies.kinematics import Motion
from world.bodies.model_section import ModelError
from world.bodies.multirotor import Airframe, Multirotor
from world.bodies.trajectory import Circle, Legs, Line, Pattern, Ramp, lawn_mower, parse_points

__all__ = [
    "Airframe",
    "Boat",
    "Circle",
    "Craft",
    "Diverged",
    "Engine",
    "Fin",
    "Legs",
    "Line",
    "Model",
    "ModelError",
    "Motion",
    "Multirotor",
    "Pattern",
    "Ramp",
    "SurfaceModel",
    "is_boat",
    "lawn_mower",
    "parse_points",
    "read_model",
    "read_surface_model",
]
