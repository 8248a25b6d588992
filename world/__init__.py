"""The simulated world: what surrounds vehicles, their dynamics, sensors and pictures."""

from support.pose import DOWN, Pose
from world.config import SECTIONS, WorldError, read_world
from world.objects import Spot, Thing, Waypoint, gliders
from world.sun import Sun
from world.world import World

__all__ = [
    "DOWN",
    "SECTIONS",
    "Pose",
    "Spot",
    "Sun",
    "Thing",
    "Waypoint",
    "World",
    "WorldError",
    "gliders",
    "read_world",
]
