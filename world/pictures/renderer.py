"""Renders the surroundings of a vehicle into the faces of a fisheye camera that looks down."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from world.attitude import rotation
from world.pictures.faces import empty_atlas, rotations
from world.pictures.mug import Glider, Mug, draw
from world.pictures.planes import Caster
from world.pictures.scenes import Pose, Surroundings

# Nadir mount: the top of the image points to the bow. Columns are the camera's x, y, z in the body frame.
MOUNT = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def camera(pose: Pose) -> NDArray[np.float64]:
    """(3, 3) rotation from the optical frame of the camera to NED."""
    return np.array(rotation(pose.roll, pose.pitch, pose.yaw)) @ MOUNT


class Renderer:
    """Draws `rows` (see Lookup) of five or six faces of `width` px; all rows by default."""

    def __init__(
        self,
        scene: Surroundings,
        width: int,
        faces: int = 5,
        rows: Sequence[tuple[int, int]] = (),
    ):
        self.scene = scene
        self.width = width
        self.faces = rotations(faces)
        self.rows = tuple(rows) or ((0, width),) * faces
        self.caster = Caster(width)

    def render(self, pose: Pose, gliders: Sequence[Glider] = ()) -> NDArray[np.uint32]:
        """The atlas of the faces (see faces.empty_atlas) at a pose, whose height must be positive."""
        atlas = empty_atlas(len(self.faces), self.width)
        turns = camera(pose) @ self.faces
        self.caster.cast(atlas, turns, self.rows, self.scene.planes(pose), (pose.north, pose.east), pose.time)
        pixels = atlas[:-1].view(np.uint8).reshape(len(turns), self.width, self.width, 4)
        for mug in _seen(pose, gliders):
            look = self.scene.seen(pose, -mug.centre[2] / float(np.linalg.norm(mug.centre)))
            for face, turn, rows in zip(pixels, turns, self.rows, strict=True):
                draw(face, turn, rows, mug, look, self.scene.sun)
        return atlas


def _seen(pose: Pose, gliders: Sequence[Glider]) -> list[Mug]:
    """The gliders as seen from the camera, the farthest first; one at the camera's very place is not seen."""
    mugs = [
        Mug((g.north - pose.north, g.east - pose.east, pose.height - g.rise), g.heading, g.length, g.diameter / 2)
        for g in gliders
    ]
    return sorted((mug for mug in mugs if any(mug.centre)), key=lambda mug: -float(np.linalg.norm(mug.centre)))
