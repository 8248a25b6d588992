"""Objects of a scene: gliders, boards, walls and marine snow, and what they hide."""

from world.rendering.objects.calibration_targets import Board, april_grid, board, chessboard
from world.rendering.objects.capsule import Capsule
from world.rendering.objects.glider import Glider
from world.rendering.objects.marine_snow import Snow
from world.rendering.objects.static_scene import Landscape, Wall

__all__ = ["Board", "Capsule", "Glider", "Landscape", "Snow", "Wall", "april_grid", "board", "chessboard"]
