"""Boards in pictures, as OpenCV sees them: corners, tags, and the camera that follows from them."""

import functools
import itertools
import math
from dataclasses import replace

import cv2
import numpy as np
import pytest

from support.pose import DOWN
from support.rotations import rotation
from tasks.vision.cameras.camera_metadata import describe_camera
from tests.repeats import repeat
from world.objects import APRIL_GRID, ObjectPosition, Waypoint, WorldObject
from world.optics import FisheyeModel, PinholeModel, kannala_brandt_lens, preset_lens
from world.rendering import (
    Board,
    Glider,
    PixelClass,
    SceneCamera,
    ScenePose,
    april_grid_cells,
    board_of_object,
    chessboard_cells,
)
from world.rendering.renderer import optical_to_ned_rotation

ROWS, COLUMNS, SQUARE, RISE = 8, 11, 0.05, 0.2
CELL = 0.015  # m
CHESS = Board(chessboard_cells(ROWS, COLUMNS), SQUARE, 0.0, 0.0, RISE)
BROWN = PinholeModel(640, 480, 520.0, 521.0, 322.3, 238.9, -0.25, 0.06, 5e-4, -3e-4)
ODD = FisheyeModel(
    640, 480, 300.0, 301.0, 322.3, 238.9, kannala_brandt_lens((0.02, -0.01, 0.003, -0.001), math.radians(175))
)
FINE = FisheyeModel(
    1280, 960, 600.0, 602.0, 644.3, 477.9, kannala_brandt_lens((0.02, -0.01, 0.003, -0.001), math.radians(175))
)
QUARTIC = FisheyeModel.from_lens(preset_lens("woodscape", math.radians(160)), 640)


def corners(board):
    """Places (m; north, east) of the corners inside of a board that is not turned, row by row."""
    rows, columns = board.cells.shape
    down, right = np.meshgrid(np.arange(2, rows - 1), np.arange(2, columns - 1), indexing="ij")
    ahead, aside = (rows / 2 - down) * board.cell_size, (right - columns / 2) * board.cell_size
    return np.stack((ahead.ravel() + board.north, aside.ravel() + board.east), axis=-1)


def standpoints(number, spread, seed=1):
    """Places from which the board is seen, up to `spread` (rad) off the axis."""
    random = np.random.default_rng(seed)
    while number:
        height, (roll, pitch), yaw = random.uniform(0.4, 0.8), random.uniform(-0.5, 0.5, 2), random.uniform(-0.4, 0.4)
        off, bearing = spread * math.sqrt(random.random()), random.uniform(-math.pi, math.pi)
        ray = np.array([math.sin(off) * math.cos(bearing), math.sin(off) * math.sin(bearing), math.cos(off)])
        toward = np.array(rotation(roll, pitch, yaw)) @ ray
        if toward[2] > 0.3:
            north, east = -toward[:2] / toward[2] * height
            yield ScenePose(north, east, height + RISE, 5.0, roll, pitch, yaw)
            number -= 1


def places(optics, pose, board):
    """Pixels (n, 2) of the corners, in OpenCV's convention."""
    ground = corners(board)
    offsets = np.column_stack((ground - (pose.north, pose.east), np.full(len(ground), pose.height - board.height)))
    return optics.project(offsets @ optical_to_ned_rotation(pose, DOWN))[0] - 0.5


@functools.cache
def sight(optics):
    return SceneCamera(optics, 0, 6, "bilinear", "Seabed", 1000.0)


def seen(optics, pose):
    """The corners that OpenCV finds, and where the camera's model has them; none if it does not find all."""
    picture = sight(optics).take_picture(pose, (), (CHESS,))
    gray = cv2.cvtColor(picture, cv2.COLOR_RGBA2GRAY)
    found, pixels = cv2.findChessboardCornersSB(gray, (COLUMNS - 1, ROWS - 1), flags=cv2.CALIB_CB_ACCURACY)
    if not found:
        return None
    wanted = places(optics, pose, CHESS)
    pixels = pixels.reshape(-1, 2)
    return (pixels if np.abs(pixels[0] - wanted[0]).max() < 5.0 else pixels[::-1]), wanted


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize("optics", [BROWN, ODD, QUARTIC], ids=["brown", "kannala", "quartic"])
def test_corners_are_found_where_they_project_to(optics):
    pairs = [pair for pose in standpoints(3, 0.1) if (pair := seen(optics, pose)) is not None]
    assert len(pairs) >= 2
    for found, wanted in pairs:
        apart = np.linalg.norm(found - wanted, axis=1)
        assert math.sqrt(np.mean(apart**2)) < 0.16  # most of it is OpenCV's own
        assert apart.max() < 0.5


@pytest.mark.heavy
def test_tags_are_found_with_their_numbers():
    """By Kalibr's documented layout: numbers from the lower left, upwards; the black border is 2 bits wide."""
    size = 8 * CELL  # m, Kalibr's tagSize
    thing = WorldObject(1, (Waypoint(0.0, 0.0, 0.0),), kind=APRIL_GRID, squares=(4, 5), square_size=size)
    grid = replace(board_of_object(thing, ObjectPosition(0.0, 0.0, 0.0, 0.3), RISE), id=0)
    optics, pose = PinholeModel(800, 600, 600.0, 600.0, 400.0, 300.0), ScenePose(0.05, 0.0, 1.2, 5.0, 0.1, -0.1, 0.2)
    picture = sight(optics).take_picture(pose, (), (grid,))
    options = cv2.aruco.DetectorParameters()
    options.markerBorderBits = 2
    options.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11), options)
    found, numbers, _ = detector.detectMarkers(cv2.cvtColor(picture, cv2.COLOR_RGBA2GRAY))
    assert sorted(numbers.ravel().tolist()) == list(range(20))
    cos, sin, apart = math.cos(0.3), math.sin(0.3), []
    for tag, number in zip(found, numbers.ravel(), strict=True):
        row, column = divmod(int(number), 5)
        # From the lower left corner of tag 0: x to the right, y upwards; OpenCV begins at the upper left.
        corners = [(1.25 * column + x, 1.25 * row + y) for x, y in ((0, 1), (1, 1), (1, 0), (0, 0))]
        ground = [((y - 4.75 / 2) * size, (x - 6.0 / 2) * size) for x, y in corners]
        turned = [(a * cos - b * sin - pose.north, a * sin + b * cos - pose.east, 1.0) for a, b in ground]
        wanted = optics.project(np.array(turned) @ optical_to_ned_rotation(pose, DOWN))[0] - 0.5
        apart += np.abs(tag.reshape(4, 2) - wanted).max(axis=1).tolist()
    assert np.quantile(apart, 0.85) < 0.3, "OpenCV takes a wrong corner here and there"


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize(("optics", "spread"), [(BROWN, 0.25), repeat((FINE, 0.45))], ids=["brown", "kannala"])
def test_a_calibration_gives_the_camera_back(optics, spread):
    """With a coarser fisheye, OpenCV draws corners far off the axis inwards by 0.1 px, in any exact picture."""
    found = (pair for pose in standpoints(60, spread) if (pair := seen(optics, pose)) is not None)
    pairs = list(itertools.islice(found, 30))
    assert len(pairs) == 30
    down, right = np.meshgrid(np.arange(ROWS - 1), np.arange(COLUMNS - 1), indexing="ij")
    flat = np.stack((right.ravel() * SQUARE, down.ravel() * SQUARE, 0.0 * down.ravel()), axis=-1)[None]
    pixels = [found[None].astype(np.float64) for found, _ in pairs]
    size = optics.width, optics.height
    if isinstance(optics, PinholeModel):
        objects = [flat.astype(np.float32)] * 30
        rms, found, *_ = cv2.calibrateCamera(
            objects, [p.astype(np.float32) for p in pixels], size, None, None, flags=cv2.CALIB_FIX_K3
        )
    else:
        flags = cv2.CALIB_FIX_SKEW | cv2.CALIB_RECOMPUTE_EXTRINSIC
        rms, found, *_ = cv2.fisheye.calibrate([flat] * 30, pixels, size, None, None, flags=flags)
    about = describe_camera(optics, DOWN)
    fx, fy, cx, cy = about["intrinsics"]
    assert rms <= 0.15
    assert (found[0, 0], found[1, 1]) == pytest.approx((fx, fy), rel=1e-3)
    assert (found[0, 2], found[1, 2]) == pytest.approx((cx, cy), abs=0.3)


@pytest.mark.heavy
@pytest.mark.parametrize("optics", [BROWN, ODD, QUARTIC], ids=["brown", "kannala", "quartic"])
def test_what_is_reported_of_a_camera_makes_lines_straight(optics):
    about = describe_camera(optics, DOWN)["opencv"]
    matrix, distortion = np.array(about["K"]), np.array(about["D"])
    undistort = cv2.fisheye.undistortPoints if about["model"] == "fisheye" else cv2.undistortPoints
    pose = next(pose for pose in standpoints(3, 0.2, seed=4) if seen(optics, pose) is not None)
    found, _ = seen(optics, pose)
    flat = undistort(found[:, None].astype(np.float64), matrix, distortion, P=matrix).reshape(ROWS - 1, COLUMNS - 1, 2)
    for line in (*flat, *flat.swapaxes(0, 1)):
        middle = line - line.mean(axis=0)
        across = np.linalg.svd(middle)[2][1]
        assert math.sqrt(np.mean((middle @ across) ** 2)) <= 0.2


def test_impossible_boards_are_refused():
    with pytest.raises(ValueError, match="1 x 5 squares"):
        chessboard_cells(1, 5)
    with pytest.raises(ValueError, match="20 x 20 tags"):
        april_grid_cells(20, 20)


@pytest.mark.parametrize("optics", [BROWN, ODD, QUARTIC], ids=["brown", "kannala", "quartic"])
def test_a_board_is_labelled_where_its_points_project_to(optics):
    """Points of the board, and of the ground around it, by the model alone; a glider above hides a part of it."""
    board = Board(chessboard_cells(ROWS, COLUMNS), SQUARE, 0.1, -0.1, 0.15, heading=0.7, id=9)
    pose, glider = ScenePose(0.0, 0.1, 0.9, 5.0, 0.15, -0.1, 0.4), Glider(0.1, -0.1, 0.4, 0.0, 0.3, 0.08, id=4)
    following = ScenePose(0.05, 0.1, 0.85, 5.05, 0.1, -0.1, 0.45)
    camera_ = SceneCamera(optics, 64, 6)
    found = camera_.labels(pose, [glider], (following, [glider]), [board])
    random = np.random.default_rng(2)
    ahead, right = random.uniform(-1.3, 1.3, (2, 4000)) * np.array([[0.25], [0.325]])
    north, east = (
        math.cos(0.7) * ahead - math.sin(0.7) * right + 0.1,
        math.sin(0.7) * ahead + math.cos(0.7) * right - 0.1,
    )
    points = np.stack((north - pose.north, east - pose.east, np.full(north.shape, 0.75)), axis=-1)
    pixels, seen = optics.project(points @ optical_to_ned_rotation(pose, DOWN))
    distance = np.linalg.norm(points, axis=1)
    margin = 2.0 * distance / optics.fx
    inside = (np.abs(ahead) < 0.25 - margin) & (np.abs(right) < 0.325 - margin) & seen
    outside = ((np.abs(ahead) > 0.25 + margin) | (np.abs(right) > 0.325 + margin)) & seen
    u, v = pixels[seen].astype(int).T
    kinds = np.zeros(seen.shape, int)
    kinds[seen] = found.kinds[v, u]
    assert set(kinds[outside]) <= {PixelClass.SEABED, PixelClass.GLIDER}
    assert set(kinds[inside]) == {PixelClass.BOARD, PixelClass.GLIDER}
    own = inside & (kinds == PixelClass.BOARD)
    u, v = pixels[own].astype(int).T
    assert found.distance[v, u] == pytest.approx(distance[own], rel=0.01)
    assert set(found.instances[v, u]) == {9}
    after = np.stack((north - following.north, east - following.east, np.full(north.shape, 0.7)), axis=-1)
    moved = optics.project(after @ optical_to_ned_rotation(following, DOWN))[0] - pixels
    assert np.abs(found.flow[v, u] - moved[own]).max() < 0.5, "within a pixel, of which the flow is that of the center"
    (body, flat) = found.boxes
    assert (body.instance, flat.instance, flat.kind, body.kind) == (4, 9, PixelClass.BOARD, PixelClass.GLIDER)
    assert flat.area == np.count_nonzero(found.instances == 9) < flat.whole_area
    assert 0.0 < flat.occluded_share < 0.5
    assert flat.cut_share == pytest.approx(np.mean(~seen[(np.abs(ahead) < 0.25) & (np.abs(right) < 0.325)]), abs=0.05)
