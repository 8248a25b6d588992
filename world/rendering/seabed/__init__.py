"""The relief of the seabed: where rays meet it, and how it is drawn."""

from world.rendering.seabed.ray_interpolation import rotate
from world.rendering.seabed.seabed_intersection import SeabedIntersector
from world.rendering.seabed.seabed_renderer import SeabedRenderer

__all__ = ["SeabedIntersector", "SeabedRenderer", "rotate"]
