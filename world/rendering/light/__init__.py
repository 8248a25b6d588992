"""Light: how water, sky and seabed color it, lamps add to it, and waves focus it."""

from world.rendering.light.caustics import Caustics
from world.rendering.light.lamps import Lamp, LampBeam, lamp_beams, parse_lamp
from world.rendering.light.scene_colors import OpticalMedium, green_water, rgb, rgba_words

__all__ = [
    "Caustics",
    "Lamp",
    "LampBeam",
    "OpticalMedium",
    "green_water",
    "lamp_beams",
    "parse_lamp",
    "rgb",
    "rgba_words",
]
