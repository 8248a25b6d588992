"""Renders what a camera sees."""

from world.rendering.camera import Camera
from world.rendering.exposure import Exposure, Shutter, noise
from world.rendering.labels import Box, Kind, Labeller, Labels
from world.rendering.light.caustics import Caustics
from world.rendering.light.lamps import Lamp, parse_lamp
from world.rendering.light.water_optics import water
from world.rendering.objects.calibration_targets import Board, april_grid, board, chessboard
from world.rendering.objects.glider import Glider
from world.rendering.panorama import Panorama
from world.rendering.remap_table import void_warning
from world.rendering.renderer import optical
from world.rendering.resampling import INTERPOLATIONS
from world.rendering.scenes import SCENES, Standpoint

__all__ = [
    "INTERPOLATIONS",
    "SCENES",
    "Board",
    "Box",
    "Camera",
    "Caustics",
    "Exposure",
    "Glider",
    "Kind",
    "Labeller",
    "Labels",
    "Lamp",
    "Panorama",
    "Shutter",
    "Standpoint",
    "april_grid",
    "board",
    "chessboard",
    "noise",
    "optical",
    "parse_lamp",
    "void_warning",
    "water",
]
