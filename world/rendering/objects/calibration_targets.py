"""Boards for calibration: a chessboard, and a grid of AprilTags, that lie flat."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from world.objects import CHESSBOARD, ObjectPosition, WorldObject
from world.rendering.cube_faces import Window, pixel_axis
from world.rendering.objects.glider import HiddenTest
from world.rendering.objects.seabed_and_walls import RestingBody

Floats = NDArray[np.floating[Any]]

SAMPLES = 4  # across a pixel of a face: an edge is shaded in steps of a sixteenth
BLACK, WHITE = 0.04, 0.9  # reflectances
THICK = 0.01  # m, of a board, by which the ground below it is never above it
CHUNK = 32  # rows of a face that are drawn together
BIT, TAG, GAP = 2, 20, 5  # cells of a bit, of a tag with Kalibr's black border of 2 bits, and of the gap between tags
CODES = """
21a146bab 92d18fe9b 7089014bb 193979e27 44153d3d7 35cd5b8cf a10ba56a0 2b874a608 b57fb8d44 4e20b5a64 61d897f2c
ab3469ffc 594ca45c2 fa1c2d2e2 97c24b972 75928624a 1caafe99a 3236ddc16 884e527d6 5771a8c7e f52925b81 2e59cc1a1
7fa58ab31 eb43384f9 3913d5345 d79b1a3b5 0dfbe768d 5cd7a031d b9c8f7a4b 46987e06b 6e0c5d527 5bc567bb4 1e6302bc2
8ac7d046a a65fe2326 5400eb616 f7a066836 2dd0afdf6 3b9cb60b1 ad6a1caf9 93b62efb5 bb210d93d dee55094b a0cd1479b
2a23abb27 4f67f4b5f 58a815818 743427d64 1dec40874 892ab3a02 38d5742ee 0c43567a1 5db311cb1 c957ca1f9 a22457823
29ace98f3 ccc52c528 da8b3578c d5b4b9e36 ac9cdd3ce cbdaa8391 1986256b1 bae6cc889 df91b10e5 a1a9d5a75 2b651aa9d
4d5c2e19d 5b163736b f753d60a8 5e84b37d2 fce43a9f2 bb926d1a6 ed8d236e5 6af846f37 ea56a5138 5d497146c 470360eca
8c4bcd67a 295f3901e f6b577e97 520602f5a b5119492e 48e299ab7 b79f5737a a814c683e 2da900583 d4aba4797 982a0e65c
f480ccc15 0b20ea732 a9506710a 0486e2ee1 b0a972615 e73f3a257 17e205b98 ec9ab2b24
"""
# The first tags of the family 36h11 (Olson 2011; Wang and Olson 2016): 36 bits each, row by row, 1 is white.


@dataclass(frozen=True, eq=False)
class Board:
    """A flat board: `cells` (rows, columns) of reflectances, 0 to 1, each `cell_size` m wide and long.

    Its middle is m north and east of the scene's origin, `height` m above the ground beneath the camera. Its first row
    is ahead, its first column to the left of its `heading` (rad). `id` is that of the object.
    """

    cells: Floats
    cell_size: float
    north: float
    east: float
    height: float = 0.0
    heading: float = 0.0
    id: int = 0


def board_of_object(thing: WorldObject, spot: ObjectPosition, rise: float) -> Board:
    """An object of the world that is a board, `rise` m above the ground beneath the camera."""
    if thing.kind == CHESSBOARD:
        cells, cell = chessboard_cells(*thing.squares), thing.square_size
    else:
        cells, cell = april_grid_cells(*thing.squares), thing.square_size / TAG  # `Square Size` is Kalibr's tagSize
    return Board(cells, cell, spot.north, spot.east, rise, spot.heading, thing.id)


@cache
def chessboard_cells(rows: int, columns: int) -> Floats:
    """The cells of a chessboard of rows and columns of squares, with a white margin; the first square is black.

    Raises ValueError for fewer than 2 squares.
    """
    if min(rows, columns) < 2:
        raise ValueError(f"{rows} x {columns} squares make no chessboard")
    cells = np.full((rows + 2, columns + 2), WHITE)
    black = np.add.outer(np.arange(rows), np.arange(columns)) % 2 == 0
    cells[1:-1, 1:-1][black] = BLACK
    return cells


@cache
def april_grid_cells(rows: int, columns: int) -> Floats:
    """The cells of a grid of tags 36h11 as Kalibr's `aprilgrid`: TAG cells wide, with gaps of GAP and a white margin.

    `tagSize` is TAG cells, with the black border of 2 bits; `tagSpacing` is GAP / TAG = 0.25. Small black squares fill
    the corners of the gaps. Tag 0 is the first one of the last row, at the lower left; numbers rise to the right, then
    from row to row upwards. A cell is half a bit.
    Raises ValueError if there are not so many tags.
    """
    codes = CODES.split()
    if min(rows, columns) < 1 or rows * columns > len(codes):
        raise ValueError(f"{rows} x {columns} tags are not 1 to {len(codes)}")
    pitch = TAG + GAP
    cells = np.full((rows * pitch + 3 * GAP, columns * pitch + 3 * GAP), WHITE)
    for row in range(rows + 1):
        for column in range(columns + 1):
            cells[GAP + row * pitch : 2 * GAP + row * pitch, GAP + column * pitch : 2 * GAP + column * pitch] = BLACK
    for number in range(rows * columns):
        row, column = divmod(number, columns)
        bits = np.array([c == "1" for c in f"{int(codes[number], 16):036b}"]).reshape(6, 6)
        tag = np.full((TAG, TAG), BLACK)
        tag[2 * BIT : -2 * BIT, 2 * BIT : -2 * BIT][bits.repeat(BIT, 0).repeat(BIT, 1)] = WHITE
        top, left = 2 * GAP + (rows - 1 - row) * pitch, 2 * GAP + column * pitch
        cells[top : top + TAG, left : left + TAG] = tag
    return cells


def board_contact_geometry(board: Board, down: float) -> RestingBody:
    """Pose of a board that is `down` m below the surface."""
    rows, columns = board.cells.shape
    c, s = math.cos(board.heading), math.sin(board.heading)
    ahead = 0.5 * board.cell_size * rows * np.repeat((-1.0, 0.0, 1.0), 3)
    right = 0.5 * board.cell_size * columns * np.tile((-1.0, 0.0, 1.0), 3)
    points = np.empty((9, 3))
    points[:, 0] = c * ahead - s * right + board.north
    points[:, 1] = s * ahead + c * right + board.east
    points[:, 2] = down
    return points, THICK, 0.5 * board.cell_size * math.hypot(rows, columns)


def draw_board(
    face: NDArray[np.uint8],
    turn: NDArray[np.float64],
    window: Window,
    board: Board,
    offset: tuple[float, float, float],
    light: Callable[[Floats, Floats], Floats],
    hidden: HiddenTest | None = None,
) -> None:
    """Draw a board into a window of a face (w, w, 4); `turn` (3, 3) rotates the face's optical frame to NED.

    `offset` is the middle of the board from the camera (m, NED); `light(reflected, distance)` is what the camera sees,
    0 to 255, of reflectances (3, n, m) at distances (n, m) in m; `hidden` marks those of its pixels that are behind
    something else.
    """
    width = face.shape[0]
    touched = _touched(turn, window, board, offset, width)
    if touched is None:
        return
    (first, last), columns = touched
    fine = (np.arange(SAMPLES) + 0.5) / SAMPLES - 0.5
    axis = pixel_axis(width).astype(np.float64)
    across = (axis[columns[0] : columns[1], np.newaxis] + fine * 2 / width).ravel()
    for start in range(first, last, CHUNK):
        rows = slice(start, min(start + CHUNK, last))
        down = (axis[rows, np.newaxis] + fine * 2 / width).ravel()
        found, cover, distance = _look(turn, board, offset, across, down)
        if not cover.any():
            continue
        if hidden is not None:
            own = np.nonzero(cover)
            pixels = own[0] + start, own[1] + columns[0]
            length = np.sqrt(axis[pixels[0]] ** 2 + axis[pixels[1]] ** 2 + 1.0)
            cover[own] *= ~hidden(pixels, length / distance[own])
        color = np.moveaxis(light(np.broadcast_to(found, (3, *found.shape)).astype(np.float32), distance), 0, -1)
        shown = face[rows, columns[0] : columns[1], :3]
        shown[...] = np.rint(shown + (color - shown) * cover[..., np.newaxis])


def _look(
    turn: NDArray[np.float64], board: Board, offset: tuple[float, float, float], across: Floats, down: Floats
) -> tuple[Floats, Floats, Floats]:
    """Mean reflectance, share of the pixel that the board covers, and distance (m), of whole pixels (n, m)."""
    x, y = np.meshgrid(across, down)
    north, east, fall = (a * x + b * y + c for a, b, c in turn)
    with np.errstate(divide="ignore", invalid="ignore"):
        far = offset[2] / fall
        n, e = far * north - offset[0], far * east - offset[1]
        cos, sin = math.cos(board.heading), math.sin(board.heading)
        ahead, right = (n * cos + e * sin) / board.cell_size, (e * cos - n * sin) / board.cell_size
        rows, columns = board.cells.shape
        row, column = np.floor(rows / 2 - ahead), np.floor(columns / 2 + right)
        hit = (far > 0.0) & (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    value = np.zeros(hit.shape)
    value[hit] = board.cells[row[hit].astype(int), column[hit].astype(int)]
    length = np.where(hit, far * np.sqrt(x * x + y * y + 1.0), 0.0)
    share, total, path = (_pooled(values) for values in (hit.astype(float), value, length))
    safe = np.maximum(share, 1e-12)
    return total / safe, share, (path / safe).astype(np.float32)


def _pooled(values: Floats) -> Floats:
    rows, columns = values.shape
    return values.reshape(rows // SAMPLES, SAMPLES, columns // SAMPLES, SAMPLES).mean(axis=(1, 3))


def _touched(
    turn: NDArray[np.float64], window: Window, board: Board, offset: tuple[float, float, float], width: int
) -> Window | None:
    """The part of a window that the board can touch: around its corners, or all if it is partly behind the face."""
    rows, columns = board.cells.shape
    a, b = rows * board.cell_size / 2, columns * board.cell_size / 2
    cos, sin = math.cos(board.heading), math.sin(board.heading)
    corners = [(s * a * cos - t * b * sin, s * a * sin + t * b * cos, 0.0) for s in (1, -1) for t in (1, -1)]
    x, y, z = (turn.T @ (np.array(offset) + corners).T).tolist()
    if max(z) <= 0.0:
        return None
    if min(z) <= 0.0:
        return window
    places = [[(v / depth + 1) * width / 2 for v, depth in zip(values, z, strict=True)] for values in (y, x)]
    spans = [
        (max(low, math.floor(min(place)) - 1), min(high, math.ceil(max(place)) + 1))
        for place, (low, high) in zip(places, window, strict=True)
    ]
    return (spans[0], spans[1]) if all(low < high for low, high in spans) else None
