"""The relief of the seabed: where rays meet it, and how it is drawn."""

from world.rendering.seabed.ray_grid import rotate
from world.rendering.seabed.relief import SeabedRelief
from world.rendering.seabed.terrain import Terrain

__all__ = ["SeabedRelief", "Terrain", "rotate"]
