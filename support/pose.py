"""Pose of a frame in another one: a sensor in its vehicle, or a vehicle in the world."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from support.rotations import Matrix, Vector, matrix_product, rotation, to_ned

Floats = NDArray[np.floating[Any]]


class Pose(NamedTuple):
    """Place (m) and Euler angles (rad): x forward, y right, z down in a vehicle; north, east, down in the world.

    A sensor without a turn looks forward, as in AirSim and ROS; one that looks down has theta = -pi/2.
    """

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    phi: float = 0.0
    theta: float = 0.0
    psi: float = 0.0

    @classmethod
    def from_transform(cls, transform: Floats) -> "Pose":
        """Pose of a frame from which a matrix (4, 4) leads to the outer one."""
        (a, b, c), (d, e, f), (g, h, i) = transform[:3, :3].tolist()
        x, y, z = transform[:3, 3].tolist()
        return cls(x, y, z, *euler_angles(((a, b, c), (d, e, f), (g, h, i))))

    @property
    def position(self) -> Vector:
        return self.x, self.y, self.z

    @property
    def rotation(self) -> Matrix:
        """Transform from this frame to the outer one."""
        return rotation(self.phi, self.theta, self.psi)

    @property
    def transform(self) -> Floats:
        """(4, 4), from this frame to the outer one."""
        found = np.eye(4)
        found[:3, :3], found[:3, 3] = self.rotation, self.position
        return found

    def compose(self, inner: "Pose") -> "Pose":
        """The pose in the outer frame of what has the pose `inner` in this one."""
        x, y, z = to_ned(self.rotation, inner.position)
        return Pose(self.x + x, self.y + y, self.z + z, *euler_angles(matrix_product(self.rotation, inner.rotation)))


DOWN = Pose(theta=-math.pi / 2)


def euler_angles(r: Matrix) -> Vector:
    """phi, theta, psi (rad) of a rotation; straight up or down, phi is 0."""
    theta = math.asin(max(-1.0, min(1.0, -r[2][0])))
    if math.hypot(r[0][0], r[1][0]) < 1e-9:
        return 0.0, theta, math.atan2(-r[0][1], r[1][1])
    return math.atan2(r[2][1], r[2][2]), theta, math.atan2(r[1][0], r[0][0])
