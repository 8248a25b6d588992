"""Renders what a camera sees."""

from world.pictures.camera import Camera
from world.pictures.lookup import void_warning
from world.pictures.sampling import INTERPOLATIONS
from world.pictures.scenes import SCENES, Pose

__all__ = [
    "INTERPOLATIONS",
    "SCENES",
    "Camera",
    "Pose",
    "void_warning",
]
