"""Renders what a camera sees."""

from world.pictures.boards import Board, april_grid, board, chessboard
from world.pictures.camera import Camera
from world.pictures.caustics import Caustics
from world.pictures.exposure import Exposure, Shutter, noise
from world.pictures.labels import Box, Kind, Labeller, Labels
from world.pictures.lamps import Lamp, parse_lamp
from world.pictures.light import water
from world.pictures.lookup import void_warning
from world.pictures.mug import Glider
from world.pictures.panorama import Panorama
from world.pictures.renderer import optical
from world.pictures.sampling import INTERPOLATIONS
from world.pictures.scenes import SCENES, Standpoint

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
