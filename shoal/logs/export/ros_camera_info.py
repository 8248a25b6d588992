"""The cameras of a log in ROS 2 types: sensor_msgs/CameraInfo, and their places in the vehicle."""

import struct
from collections.abc import Iterable

import numpy as np

from shoal.logs.export.camera_calibration import LoggedCamera
from shoal.logs.export.cdr import cdr_string
from shoal.logs.export.ros_types import STANDARD, RosType
from support.rotations import quaternion_from_matrix

CAMERA_INFO = RosType(
    "sensor_msgs/CameraInfo",
    "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\n"
    "float64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\nRegionOfInterest roi\n",
    dependencies={
        **STANDARD,
        "sensor_msgs/RegionOfInterest": "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\n"
        "bool do_rectify\n",
    },
)
MODELS = {"radtan": "plumb_bob", "equidistant": "equidistant"}  # of image_geometry, by Kalibr's names
PINHOLES = {5: "plumb_bob", 8: "rational_polynomial"}  # by the coefficients that OpenCV has
PARALLEL = 1e-4  # rad, m, by which a pair may be off
FLU = np.diag([1.0, -1.0, -1.0])  # from forward, right, down to forward, left, up
BILLION = 1_000_000_000


def stereo_baseline(camera: LoggedCamera, cameras: Iterable[LoggedCamera]) -> float:
    """m from the left camera of a parallel pair to this right one, along the rows; 0 for another camera.

    A pair has one attitude and size, and one set of focal lengths and centers (REP 104); of several the nearest counts.
    """
    found = list[float]()
    for other in cameras:
        apart = np.linalg.inv(other.pose) @ camera.pose
        if (
            all(camera.model.get(name) == other.model.get(name) for name in ("resolution", "intrinsics"))
            and _opencv_matrix(camera) == _opencv_matrix(other)
            and np.abs(apart[:3, :3] - np.eye(3)).max() < PARALLEL
            and apart[0, 3] > PARALLEL
            and np.abs(apart[1:3, 3]).max() < PARALLEL * max(1.0, apart[0, 3])
        ):
            found.append(float(apart[0, 3]))
    return min(found, default=0.0)


def camera_info(time: int, frame: str, camera: LoggedCamera, baseline: float = 0.0) -> bytes:
    """A CAMERA_INFO, time in ns, of a camera `baseline` m to the right of its left one; empty without a ROS model."""
    model = camera.model
    if _is_beyond_kalibr(camera):
        (fx, _, cx), (_, fy, cy), _ = model["opencv"]["K"]
        d = list(model["opencv"]["D"])
        name = PINHOLES.get(len(d))
    else:
        name = MODELS.get(model.get("distortion_model", "")) if model.get("camera_model") == "pinhole" else None
        fx, fy, cx, cy = model["intrinsics"] if name else (0.0, 0.0, 0.0, 0.0)
        d = [*model["distortion_coeffs"], *([0.0] if name == "plumb_bob" else [])] if name else []
    if name is None:
        return b""
    k = [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
    p = [fx, 0.0, cx, -fx * baseline, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]
    width, height = model["resolution"]
    body = _header(time, frame)
    body += _aligned(body, 4) + struct.pack("<II", height, width) + cdr_string(name.encode())
    body += _aligned(body, 4) + struct.pack("<I", len(d))
    body += _aligned(body, 8) + struct.pack(f"<{len(d)}d", *d)
    body += struct.pack("<30d", *k, *np.eye(3).ravel(), *p)
    return body + struct.pack("<6I?", 0, 0, 0, 0, 0, 0, False)


def missing_info_reason(camera: LoggedCamera) -> str:
    """Reason why a camera has no CAMERA_INFO."""
    model = camera.model
    if _is_beyond_kalibr(camera):
        return f"ROS has no lens of {len(model['opencv']['D'])} coefficients"
    if "intrinsics" not in model:
        return str(model.get("not_in_kalibr", "it has no intrinsics"))
    return f"ROS has no model {model['camera_model']} with {model.get('distortion_model', 'no distortion')}"


def _is_beyond_kalibr(camera: LoggedCamera) -> bool:
    """Whether a pinhole camera has a lens that Kalibr lacks, and OpenCV has: k3, or a rational one."""
    fitted = "fit_rms_px" in camera.model or "not_in_kalibr" in camera.model
    return fitted and camera.model.get("opencv", {}).get("model") == "pinhole"


def _opencv_matrix(camera: LoggedCamera) -> object:
    return camera.model.get("opencv", {}).get("K")


def encode_camera_transform(time: int, vehicle: str, frame: str, camera: LoggedCamera) -> bytes:
    """A TRANSFORM from the optical frame of a camera to its vehicle (forward, left, up); time in ns."""
    pose = camera.pose
    x, y, z = (FLU @ pose[:3, 3]).tolist()
    qw, qx, qy, qz = quaternion_from_matrix((FLU @ pose[:3, :3]).tolist())
    body = struct.pack("<I", 1) + _header(time, vehicle)
    body += _aligned(body, 4) + cdr_string(frame.encode())
    return body + _aligned(body, 8) + struct.pack("<7d", x, y, z, qx, qy, qz, qw)


def _header(time: int, frame: str) -> bytes:
    return struct.pack("<II", *divmod(time, BILLION)) + cdr_string(frame.encode())


def _aligned(body: bytes, size: int) -> bytes:
    """Padding, so that the next value begins at a multiple of its size."""
    return bytes(-len(body) % size)
