"""Light: how water, sky and seabed color it, lamps add to it, and waves focus it."""

from world.rendering.light.caustics import Caustics
from world.rendering.light.lamps import Beam, Lamp, beams, parse_lamp
from world.rendering.light.water_optics import OpticalMedium, rgb, rgba_words, water

__all__ = ["Beam", "Caustics", "Lamp", "OpticalMedium", "beams", "parse_lamp", "rgb", "rgba_words", "water"]
