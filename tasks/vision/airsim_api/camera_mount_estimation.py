"""Mount of AirSim's camera in its vehicle, and pose of the vehicle at the instant of a picture."""

import math

import numpy as np

from support.rotations import quaternion_from_matrix
from tasks.vision.airsim_api.rpc_messages import AirSimQuaternion, AirSimVector, Kinematics, pose_transform
from world.optics import Floats

CLOSE = 1e-3  # m, rad, by which AirSim's numbers may be off


class MountEstimator:
    """Measures where a camera is in a vehicle that moves.

    AirSim gives no time with the motion of a vehicle, so that is asked for before and after the pictures. The camera
    is measured against the middle of both when the vehicle moves least, best at rest. That counts as long as it is
    possible: a camera that has been turned in the vehicle is measured anew.
    """

    def __init__(self) -> None:
        self._found: Floats | None = None
        self._loose = math.inf  # m and rad that the vehicle moved at that

    def vehicle_motion_at_capture(self, before: Kinematics, camera: Floats, after: Kinematics) -> Kinematics:
        """The motion of the vehicle at the instant of a picture, whose camera (4, 4) was in the north, east, down.

        Raises AirSimError for poses that are none.
        """
        first, last = (pose_transform(each.position, each.orientation) for each in (before, after))
        middle = mean_pose(first, last)
        arm = float(np.linalg.norm(camera[:3, 3] - middle[:3, 3]))
        loose, measured = pose_distance(first, last, 1.0 + arm), np.linalg.inv(middle) @ camera
        if (
            self._found is None
            or loose <= self._loose
            or pose_distance(measured, self._found) > loose + self._loose + CLOSE
        ):
            self._found, self._loose = measured, loose
        return Kinematics(
            *position_and_orientation(camera @ np.linalg.inv(self._found)),
            mean_vector(before.linear_velocity, after.linear_velocity),
            mean_vector(before.angular_velocity, after.angular_velocity),
        )


def pose_distance(a: Floats, b: Floats, arm: float = 1.0) -> float:
    """The distance of two poses (4, 4): m, and rad times `arm` (m)."""
    return float(np.linalg.norm(a[:3, 3] - b[:3, 3])) + arm * rotation_angle_between(a[:3, :3], b[:3, :3])


def rotation_angle_between(a: Floats, b: Floats) -> float:
    """The angle (rad) of the rotation that takes one rotation (3, 3) to another."""
    return math.acos(max(-1.0, min(1.0, (float(np.trace(a.T @ b)) - 1.0) / 2.0)))


def mean_pose(a: Floats, b: Floats) -> Floats:
    """The pose (4, 4) in the middle of two."""
    p, q = (np.array(quaternion_from_matrix(each[:3, :3].tolist())) for each in (a, b))
    both = p + math.copysign(1.0, float(p @ q)) * q
    return pose_transform(
        mean_vector(position_and_orientation(a)[0], position_and_orientation(b)[0]),
        AirSimQuaternion(*(both / np.linalg.norm(both)).tolist()),
    )


def position_and_orientation(pose: Floats) -> tuple[AirSimVector, AirSimQuaternion]:
    return AirSimVector(*pose[:3, 3].tolist()), AirSimQuaternion(*quaternion_from_matrix(pose[:3, :3].tolist()))


def mean_vector(a: AirSimVector, b: AirSimVector) -> AirSimVector:
    return AirSimVector((a.x_val + b.x_val) / 2, (a.y_val + b.y_val) / 2, (a.z_val + b.z_val) / 2)
