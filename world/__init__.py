"""The simulated world: what surrounds vehicles, their dynamics, sensors and pictures."""

from support.pose import DOWN, Pose
from world.config import WorldError, has_same_words, older_option_text, older_places, read_world, world_option_name
from world.objects import ObjectPosition, Waypoint, WorldObject, make_gliders
from world.options import SECTIONS
from world.sun import Sun
from world.world import World

__all__ = [
    "DOWN",
    "SECTIONS",
    "ObjectPosition",
    "Pose",
    "Sun",
    "Waypoint",
    "World",
    "WorldError",
    "WorldObject",
    "has_same_words",
    "make_gliders",
    "older_option_text",
    "older_places",
    "read_world",
    "world_option_name",
]
