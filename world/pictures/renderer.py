"""Renders the surroundings of a vehicle into the faces of a camera."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from world.attitude import rotation
from world.pictures import boards, light, snow
from world.pictures.boards import Board
from world.pictures.caustics import Caustics
from world.pictures.faces import empty_atlas, rotations
from world.pictures.lamps import Lamp, beams
from world.pictures.mug import Glider, Mug, draw
from world.pictures.planes import Caster
from world.pictures.scenes import Seabed, Standpoint, Surroundings
from world.pictures.snow import Snow
from world.pose import DOWN, Pose

# Columns are the x (right), y (down) and z (ahead) of a picture in the frame of the sensor that takes it.
OPTICAL = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def optical(mount: Pose) -> NDArray[np.float64]:
    """(4, 4), from the optical frame of a camera to the frame in which it has a pose: T_BS of a data set."""
    turn = np.eye(4)
    turn[:3, :3] = OPTICAL
    return np.asarray(mount.transform @ turn, np.float64)


def camera(pose: Standpoint, mount: Pose = DOWN) -> NDArray[np.float64]:
    """(3, 3) rotation from the optical frame of the camera to NED."""
    return np.array(rotation(pose.roll, pose.pitch, pose.yaw)) @ optical(mount)[:3, :3]


class Renderer:
    """Draws `rows` and `columns` (see Lookup) of five or six faces of `width` px, all by default."""

    def __init__(
        self,
        scene: Surroundings,
        width: int,
        faces: int = 5,
        rows: Sequence[tuple[int, int]] = (),
        columns: Sequence[tuple[int, int]] = (),
        mount: Pose = DOWN,
        lamps: Sequence[Lamp] = (),
        snow: Snow | None = None,
        caustics: Caustics | None = None,
    ):
        self.scene = scene
        self.width = width
        self.faces = rotations(faces)
        self.rows, self.columns = (tuple(some) or ((0, width),) * faces for some in (rows, columns))
        self.mount, self.lamps = mount, tuple(lamps)
        self.caster = Caster(width)
        self.snow, self.caustics = snow, caustics

    def render(
        self, vehicle: Standpoint, gliders: Sequence[Glider] = (), flat: Sequence[Board] = ()
    ) -> NDArray[np.uint32]:
        """The atlas of the faces (see faces.empty_atlas); the camera's height must be positive."""
        atlas = empty_atlas(len(self.faces), self.width)
        pose, turns = vehicle.carried(self.mount), camera(vehicle, self.mount) @ self.faces
        windows = list(zip(self.rows, self.columns, strict=True))
        lights = beams(self.lamps, vehicle.pose, self.mount)
        self.caster.cast(atlas, turns, windows, self.scene.planes(pose, lights), (pose.north, pose.east), pose.time)
        pixels = atlas[:-1].view(np.uint8).reshape(len(turns), self.width, self.width, 4)
        if self.caustics is not None and isinstance(self.scene, Seabed):
            place, shown = (pose.north, pose.east, pose.depth, pose.height), self.scene.shown(pose, lights)
            for face, turn, window in zip(pixels, turns, windows, strict=True):
                self.caustics.lay(face, turn, window, self.caster.axis, place, pose.time, shown)
        for board in flat:
            offset = board.north - pose.north, board.east - pose.east, pose.height - board.rise
            look = self.scene.seen(pose, offset, lights)
            for face, turn, window in zip(pixels, turns, windows, strict=True):
                boards.draw(face, turn, window, board, offset, look)
        for mug in _seen(pose, gliders):
            look = self.scene.seen(pose, mug.centre, lights)
            for face, turn, window in zip(pixels, turns, windows, strict=True):
                draw(face, turn, window, mug, look, self.scene.sun)
        if lights and isinstance(self.scene, Seabed):
            for face, turn, (rows, columns) in zip(pixels, turns, windows, strict=True):
                window = slice(*rows), slice(*columns)
                light.lay_over(face[window], self.scene.veil(pose, turn, self.width, lights)[:, *window])
        if self.snow is not None and isinstance(self.scene, Seabed):
            flakes = self.snow.around(pose.north, pose.east, pose.depth, pose.height, pose.time)
            shine = self.scene.afloat(pose, flakes.points, lights)
            for face, turn, window in zip(pixels, turns, windows, strict=True):
                snow.draw(face, turn, window, flakes, shine)
        return atlas


def _seen(pose: Standpoint, gliders: Sequence[Glider]) -> list[Mug]:
    """The gliders as seen from the camera, the farthest first; one at the camera's very place is not seen."""
    mugs = [
        Mug((g.north - pose.north, g.east - pose.east, pose.height - g.rise), g.heading, g.length, g.diameter / 2)
        for g in gliders
    ]
    return sorted((mug for mug in mugs if any(mug.centre)), key=lambda mug: -float(np.linalg.norm(mug.centre)))
