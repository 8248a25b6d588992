"""Renders what a camera sees."""

from world.rendering.cube_map_resampler import CubeMapAssembler
from world.rendering.image_sensor import Exposure, Shutter, frame_random
from world.rendering.labels import ImageLabels, Labeler, ObjectBox, PixelClass
from world.rendering.light.caustics import Caustics
from world.rendering.light.lamps import Lamp, parse_lamp
from world.rendering.light.scene_colors import green_water
from world.rendering.objects.calibration_targets import Board, april_grid_cells, board_of_object, chessboard_cells
from world.rendering.objects.glider import Glider
from world.rendering.remap_interpolation import INTERPOLATIONS
from world.rendering.remap_table import uncovered_warning
from world.rendering.renderer import optical_to_body_transform
from world.rendering.scene_camera import SceneCamera
from world.rendering.scenes import SCENES, ScenePose

__all__ = [
    "INTERPOLATIONS",
    "SCENES",
    "Board",
    "Caustics",
    "CubeMapAssembler",
    "Exposure",
    "Glider",
    "ImageLabels",
    "Labeler",
    "Lamp",
    "ObjectBox",
    "PixelClass",
    "SceneCamera",
    "ScenePose",
    "Shutter",
    "april_grid_cells",
    "board_of_object",
    "chessboard_cells",
    "frame_random",
    "green_water",
    "optical_to_body_transform",
    "parse_lamp",
    "uncovered_warning",
]
