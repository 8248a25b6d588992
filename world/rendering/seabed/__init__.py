"""The relief of the seabed: where rays meet it, and how it is drawn."""

from world.rendering.seabed.ray_grid import turned
from world.rendering.seabed.relief import Relief
from world.rendering.seabed.terrain import Terrain

__all__ = ["Relief", "Terrain", "turned"]
