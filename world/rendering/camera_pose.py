"""Pose of a camera in a scene, by its mount in the vehicle, and of bodies relative to it."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from support.pose import Pose
from support.rotations import Vector
from world.optics import CameraModel, Floats
from world.rendering.objects.calibration_targets import Board
from world.rendering.objects.capsule import Capsule
from world.rendering.objects.glider import Glider, glider_contact_geometry
from world.rendering.objects.seabed_and_walls import RestingBody, SeabedAndWalls
from world.rendering.renderer import optical_to_ned_rotation
from world.rendering.scenes import SCENES, SHALLOWEST, ScenePose

Places = NDArray[np.intp]

FARTHEST = 1e7  # m, of a camera from the scene's origin
MOST_IDS = 65535
SAMPLES = 32  # across a board, to find how much of it the picture shows


class CameraPose(NamedTuple):
    """A camera: `rotation` (3, 3) from its optical frame to NED, its place in m north and east of the scene's origin.

    It is `height` m above the plane below, and `depth` m below the plane above, infinite for the sky; `down` is how far
    it is below the surface of the sea (m).
    """

    rotation: Floats
    north: float
    east: float
    height: float
    depth: float
    down: float

    @classmethod
    def from_pose(cls, standpoint: ScenePose, mount: Pose, scene: str, landscape: SeabedAndWalls) -> "CameraPose":
        """Pose of a vehicle in one of SCENES. Raises ValueError for one in ground or walls, or without a position."""
        where = standpoint.north, standpoint.east, standpoint.height, standpoint.depth
        angles = standpoint.roll, standpoint.pitch, standpoint.yaw
        if not all(map(math.isfinite, (*where, *angles, *mount))):
            raise ValueError(f"{standpoint} of a camera at {mount} is not finite")
        if max(map(abs, where)) > FARTHEST:
            raise ValueError(f"{standpoint} is more than {FARTHEST:g} m away")
        place = standpoint.at_mount(mount)
        spot = place.north, place.east, place.depth
        height = landscape.height_above_ground(*spot, place.height)
        if not height > 0.0:
            raise ValueError(f"a camera {height:g} m above the ground is under it")
        if trouble := landscape.obstruction(spot, place.height):
            raise ValueError(trouble)
        landscape.check_height(*where[:2], standpoint.depth, standpoint.height)
        depth = max(place.depth, SHALLOWEST) if scene == "Seabed" else math.inf
        return cls(
            optical_to_ned_rotation(standpoint, mount), place.north, place.east, place.height, depth, place.depth
        )

    @property
    def position(self) -> Vector:
        return self.north, self.east, self.down

    def vector_to_glider(self, glider: Glider) -> Floats:
        """(3,) m north, east and down from the camera to the middle of a glider."""
        return np.array((glider.north - self.north, glider.east - self.east, self.height - glider.height))

    def glider_contact_geometry(self, glider: Glider) -> RestingBody:
        """Pose of a glider on the ground."""
        down = self.down + self.height - glider.height
        return glider_contact_geometry(
            glider.north, glider.east, down, glider.heading, glider.length, 0.5 * glider.diameter
        )

    def capsule_of(self, glider: Glider) -> Capsule:
        """A glider as the camera sees it. Raises ValueError if the camera is within it, or if it has no size."""
        if not all(map(math.isfinite, glider)):
            raise ValueError(f"object {glider.id} is not finite: {glider}")
        if not 0.0 < glider.diameter <= glider.length:
            size = f"{glider.length:g} m by {glider.diameter:g} m"
            raise ValueError(f"object {glider.id}: {size} is not a length and a diameter")
        bow = np.array((math.cos(glider.heading), math.sin(glider.heading), 0.0))
        radius = glider.diameter / 2
        body = Capsule(
            _turned(self.vector_to_glider(glider), self.rotation),
            _turned(bow, self.rotation),
            glider.length / 2 - radius,
            radius,
        )
        if float(np.linalg.norm(body.axis_point_nearest_camera)) <= radius:
            raise ValueError(f"the camera is within object {glider.id}")
        return body


def board_pixels_and_distances(board: Board, sight: CameraPose, rays: Floats) -> tuple[Places, Floats]:
    """The pixels (n,) whose rays (3, n; optical frame) meet a board, and how far off (m)."""
    a, b, c = (row[:, np.newaxis] for row in sight.rotation)
    with np.errstate(divide="ignore", invalid="ignore"):
        far = (sight.height - board.height) / (c * rays).sum(axis=0)
        north = far * (a * rays).sum(axis=0) + sight.north - board.north
        east = far * (b * rays).sum(axis=0) + sight.east - board.east
        ahead, right = _along(board, north, east)
        rows, columns = board.cells.shape
        hit = (
            (far > 0.0) & (np.abs(ahead) < rows / 2 * board.cell_size) & (np.abs(right) < columns / 2 * board.cell_size)
        )
    pixels = np.flatnonzero(hit)
    return pixels, far[pixels]


def board_cut_share(board: Board, sight: CameraPose, optics: CameraModel) -> float:
    """The share, 0 to 1, of a board that lies beyond the picture."""
    rows, columns = board.cells.shape
    fine = (np.arange(SAMPLES, dtype=np.float64) + 0.5) / SAMPLES - 0.5
    ahead: Floats = np.repeat(fine, SAMPLES) * (rows * board.cell_size)
    right: Floats = np.tile(fine, SAMPLES) * (columns * board.cell_size)
    c, s = math.cos(board.heading), math.sin(board.heading)
    points = np.empty((SAMPLES * SAMPLES, 3))
    points[:, 0] = c * ahead - s * right + board.north - sight.north
    points[:, 1] = s * ahead + c * right + board.east - sight.east
    points[:, 2] = sight.height - board.height
    return float(1.0 - optics.project(points @ sight.rotation)[1].mean())


def _along(board: Board, north: Floats, east: Floats) -> tuple[Floats, Floats]:
    c, s = math.cos(board.heading), math.sin(board.heading)
    return c * north + s * east, c * east - s * north


def check_scene_name(scene: str) -> None:
    """Raises ValueError unless it is one of SCENES."""
    if scene not in SCENES:
        raise ValueError(f"{scene!r} is not one of the scenes {', '.join(SCENES)}")


def number_gliders(gliders: Sequence[Glider]) -> tuple[Glider, ...]:
    """Gliders with their numbers; from 1 in their order if none has one. Raises ValueError unless all are different."""
    if not any(glider.id for glider in gliders):
        return tuple(glider._replace(id=number) for number, glider in enumerate(gliders, start=1))
    ids = [glider.id for glider in gliders]
    for number, glider in zip(ids, gliders, strict=True):
        if not 0 < number <= MOST_IDS or ids.count(number) > 1:
            raise ValueError(f"the number {number} of {glider} is not within 1 and {MOST_IDS}, or taken twice")
    return tuple(gliders)


def _turned(vector: Floats, turn: Floats) -> Floats:
    """Rotation from NED to the optical frame."""
    return (vector[:, np.newaxis] * turn).sum(axis=0)
