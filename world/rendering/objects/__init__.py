"""Objects of a scene: gliders, boards, walls and marine snow, and what they hide."""

from world.rendering.objects.calibration_targets import Board, april_grid_cells, board_of_object, chessboard_cells
from world.rendering.objects.capsule import Capsule
from world.rendering.objects.glider import Glider
from world.rendering.objects.marine_snow import MarineSnow
from world.rendering.objects.seabed_and_walls import SeabedAndWalls, Wall

__all__ = [
    "Board",
    "Capsule",
    "Glider",
    "MarineSnow",
    "SeabedAndWalls",
    "Wall",
    "april_grid_cells",
    "board_of_object",
    "chessboard_cells",
]
