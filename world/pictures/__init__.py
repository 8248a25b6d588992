"""Renders what a camera sees."""

from world.pictures.camera import Camera
from world.pictures.lookup import void_warning
from world.pictures.mug import Glider
from world.pictures.sampling import INTERPOLATIONS
from world.pictures.scenes import SCENES, Pose

__all__ = [
    "INTERPOLATIONS",
    "SCENES",
    "Camera",
    "Glider",
    "Pose",
    "void_warning",
]
