"""Descriptions of pictures in a log: a message for each frame, and a file that describes the cameras."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

import imc
from support.atomic_files import write_file
from support.pose import Pose
from support.rotations import Quaternion, quaternion_from_matrix
from world.optics import CameraModel, FisheyeModel, Floats
from world.rendering import optical_to_body_transform

CAMERAS_FILE = "cameras.yaml"
HEAD = """\
# The cameras whose pictures are in this folder. T_BS (4, 4) leads from the optical frame of a camera (x right, y down,
# z ahead) to the body of the vehicle (x forward, y right, z down; m). The center of the first pixel is (0, 0), as in
# OpenCV and Kalibr; a lens that they lack is fitted, fit_rms_px off.
"""


def camera_frame_message(
    time: float,
    index: int,
    optics: CameraModel,
    pose: Floats,
    estimate: Floats | None,
    file: str,
    *,
    is_true: bool,
) -> imc.CameraFrame:
    """The message that describes a frame; `pose` and `estimate` (4, 4) lead from the optical frame to NED."""
    estimated = np.full((4, 4), np.nan) if estimate is None else estimate
    (x, y, z), (qw, qx, qy, qz) = _parts(pose)
    (est_x, est_y, est_z), (est_qw, est_qx, est_qy, est_qz) = _parts(estimated)
    return imc.CameraFrame(
        index=index,
        time=time,
        width=optics.width,
        height=optics.height,
        fx=optics.fx,
        fy=optics.fy,
        cx=optics.cx,
        cy=optics.cy,
        pose=imc.CameraFrame.Pose.TRUTH if is_true else imc.CameraFrame.Pose.ESTIMATE,
        x=x,
        y=y,
        z=z,
        qw=qw,
        qx=qx,
        qy=qy,
        qz=qz,
        est_x=est_x,
        est_y=est_y,
        est_z=est_z,
        est_qw=est_qw,
        est_qx=est_qx,
        est_qy=est_qy,
        est_qz=est_qz,
        file=file,
    )


def _parts(transform: Floats) -> tuple[tuple[float, ...], Quaternion]:
    return tuple(transform[:3, 3].tolist()), quaternion_from_matrix(transform[:3, :3].tolist())


def write_cameras(
    folder: Path,
    cameras: Mapping[str, tuple[CameraModel, Pose]],
    readouts: Mapping[str, float] = MappingProxyType({}),
) -> str:
    """Write the models, mounts and readout times (s) of cameras, by entity label; returns an error text, or ""."""
    import yaml  # slow to import, and most runs save no pictures

    text = HEAD + yaml.safe_dump(
        {name: describe_camera(*camera, readouts.get(name, 0.0)) for name, camera in cameras.items()}, sort_keys=False
    )
    path = folder / CAMERAS_FILE
    try:
        write_file(path, text.encode())
    except OSError as error:
        return f"cannot write {path}: {error.strerror or error}"
    return ""


def describe_camera(optics: CameraModel, mount: Pose, readout: float = 0.0) -> dict[str, Any]:
    """A camera in the terms of Kalibr and OpenCV, where they have its model, and its place.

    `readout` (s) passes over all rows of a rolling shutter, `line_delay` from the start of one row to that of the next
    (Kalibr, aslam_cv_cameras/RollingShutter.hpp). Kalibr counts rows from a stamp of the first one: that is
    `first_row` (s) from ours, of the middle of the picture.
    """
    found: dict[str, Any] = {"T_BS": optical_to_body_transform(mount).tolist()}
    if isinstance(optics, FisheyeModel) and optics.lens.kannala_brandt_coefficients is None:
        found["quartic"] = {"k": list(optics.lens.k), "fov": optics.lens.fov, "focal_lengths": [optics.fx, optics.fy]}
    if readout:
        delay = readout / optics.height
        found |= {"readout_time": readout, "line_delay": delay, "time_of": "middle row"}
        found["first_row"] = -0.5 * (readout - delay)
    try:
        found |= optics.to_kalibr()
    except ValueError as error:
        found |= {"not_in_kalibr": str(error), "resolution": [optics.width, optics.height]}
    try:
        found["opencv"] = _opencv(optics)
    except ValueError as error:
        found["not_in_opencv"] = str(error)
    return found


def _opencv(optics: CameraModel) -> dict[str, Any]:
    rms: dict[str, Any] = {}
    if isinstance(optics, FisheyeModel) and optics.lens.kannala_brandt_coefficients is None:
        optics, rms["fit_rms_px"] = optics.fit_kannala_brandt()
    found = optics.to_opencv()
    rms |= {name: found[name] for name in ("max_angle", "xi") if name in found}
    return {"model": found["model"], "K": found["K"].tolist(), "D": found["D"].tolist(), **rms}
