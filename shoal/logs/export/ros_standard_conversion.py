"""Topics of standard types, which viewers show without setup: position, pose, motion, transform, log book, pictures.

Poses follow REP 103: the frame `map` is east, north, up, at the first reference position of the log, on the ellipsoid's
tangent plane there; a vehicle's own frame is forward, left, up and has the vehicle's name.
"""

import math
from typing import Any, NamedTuple

import numpy as np

import imc
from imc.lsf import positions
from runtime.logs import Array
from shoal.logs.export.cdr import Item, cdr_string
from shoal.logs.export.ros_types import STANDARD, RosType
from support.wgs84_arrays import displacement

MAP = b"map"
STAMP: tuple[Item, ...] = (("sec", "i"), ("nanosec", "I"))
STATE = frozenset({"lat", "lon", "height", "x", "y", "z", "phi", "theta", "psi"})
MOTION = STATE | frozenset({"u", "v", "w", "p", "q", "r"})
PLACE = ("x", "y", "z", "qx", "qy", "qz", "qw")
FIX = frozenset({"validity", "type", "lat", "lon", "height", "hacc", "vacc"})
_GEOMETRY = {
    "Point": "float64 x\nfloat64 y\nfloat64 z\n",
    "Vector3": "float64 x\nfloat64 y\nfloat64 z\n",
    "Quaternion": "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n",
    "Pose": "Point position\nQuaternion orientation\n",
    "PoseWithCovariance": "Pose pose\nfloat64[36] covariance\n",
    "Twist": "Vector3 linear\nVector3 angular\n",
    "TwistWithCovariance": "Twist twist\nfloat64[36] covariance\n",
    "Transform": "Vector3 translation\nQuaternion rotation\n",
    "TransformStamped": "std_msgs/Header header\nstring child_frame_id\nTransform transform\n",
}


def geometry_definitions(*names: str) -> dict[str, str]:
    return {f"geometry_msgs/{name}": _GEOMETRY[name] for name in names}


LOCATION = RosType(
    "sensor_msgs/NavSatFix",
    "std_msgs/Header header\nsensor_msgs/NavSatStatus status\nfloat64 latitude\nfloat64 longitude\nfloat64 altitude\n"
    "float64[9] position_covariance\nuint8 COVARIANCE_TYPE_UNKNOWN=0\nuint8 COVARIANCE_TYPE_APPROXIMATED=1\n"
    "uint8 COVARIANCE_TYPE_DIAGONAL_KNOWN=2\nuint8 COVARIANCE_TYPE_KNOWN=3\nuint8 position_covariance_type\n",
    dependencies={
        **STANDARD,
        "sensor_msgs/NavSatStatus": "int8 STATUS_UNKNOWN=-2\nint8 STATUS_NO_FIX=-1\nint8 STATUS_FIX=0\n"
        "int8 STATUS_SBAS_FIX=1\nint8 STATUS_GBAS_FIX=2\nint8 status -2\nuint16 SERVICE_UNKNOWN=0\n"
        "uint16 SERVICE_GPS=1\nuint16 SERVICE_GLONASS=2\nuint16 SERVICE_COMPASS=4\nuint16 SERVICE_GALILEO=8\n"
        "uint16 service\n",
    },
)
POSE = RosType(
    "geometry_msgs/PoseStamped",
    "std_msgs/Header header\nPose pose\n",
    dependencies={**STANDARD, **geometry_definitions("Pose", "Point", "Quaternion")},
)
TRANSFORM = RosType(
    "tf2_msgs/TFMessage",
    "geometry_msgs/TransformStamped[] transforms\n",
    dependencies={**STANDARD, **geometry_definitions("TransformStamped", "Transform", "Vector3", "Quaternion")},
)
ODOMETRY = RosType(
    "nav_msgs/Odometry",
    "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
    "geometry_msgs/TwistWithCovariance twist\n",
    dependencies={
        **STANDARD,
        **geometry_definitions("PoseWithCovariance", "Pose", "Point", "Quaternion"),
        **geometry_definitions("TwistWithCovariance", "Twist", "Vector3"),
    },
)
LOG = RosType(
    "rcl_interfaces/Log",
    "uint8 DEBUG=10\nuint8 INFO=20\nuint8 WARN=30\nuint8 ERROR=40\nuint8 FATAL=50\nbuiltin_interfaces/Time stamp\n"
    "uint8 level\nstring name\nstring msg\nstring file\nstring function\nuint32 line\n",
    dependencies={"builtin_interfaces/Time": STANDARD["builtin_interfaces/Time"]},
)
IMAGE = RosType(
    "sensor_msgs/CompressedImage", "std_msgs/Header header\nstring format\nuint8[] data\n", dependencies={**STANDARD}
)

LEVELS = {
    imc.LogBookEntry.Type.DEBUG: 10,
    imc.LogBookEntry.Type.INFO: 20,
    imc.LogBookEntry.Type.WARNING: 30,
    imc.LogBookEntry.Type.ERROR: 40,
    imc.LogBookEntry.Type.CRITICAL: 50,
}


def location_layout(frame: bytes) -> tuple[Item, ...]:
    """The layout of LOCATION."""
    return (
        *STAMP,
        frame,
        ("status", "b"),
        ("service", "H"),
        ("latitude", "d"),
        ("longitude", "d"),
        ("altitude", "d"),
        ("covariance", "d", 9),
        ("covariance_type", "B"),
    )


def pose_layout() -> tuple[Item, ...]:
    """The layout of POSE."""
    return (*STAMP, MAP, *((name, "d") for name in PLACE))


def odometry_layout(frame: bytes) -> tuple[Item, ...]:
    """The layout of ODOMETRY."""
    return (
        *STAMP,
        MAP,
        frame,
        *((name, "d") for name in PLACE),
        ("pose_covariance", "d", 36),
        *((name, "d") for name in ("u", "v", "w", "p", "q", "r")),
        ("twist_covariance", "d", 36),
    )


def transform_layout(frame: bytes) -> tuple[Item, ...]:
    """The layout of TRANSFORM with one transform."""
    return (("count", "I"), *STAMP, MAP, frame, *((name, "d") for name in PLACE))


def fill_state_location(records: Array, states: Array) -> None:
    """Positions of states (EstimatedState, SimulatedState); height above the ellipsoid, as in ROS."""
    places = positions(states)
    records["latitude"], records["longitude"] = np.degrees(places["lat"]), np.degrees(places["lon"])
    records["altitude"] = places["height"]


def fill_gps_location(records: Array, fixes: Array) -> None:
    """Positions of GpsFix; covariances if it has accuracies."""
    validity = imc.GpsFix.Validity
    valid = fixes["validity"]
    good = (valid & validity.VALID_POS) != 0
    records["status"] = np.where(good, np.where(fixes["type"] == imc.GpsFix.Type.DIFFERENTIAL, 2, 0), -1)
    records["service"] = 1
    records["latitude"], records["longitude"] = np.degrees(fixes["lat"]), np.degrees(fixes["lon"])
    records["altitude"] = fixes["height"]
    known = (valid & (validity.VALID_HACC | validity.VALID_VACC)) == validity.VALID_HACC | validity.VALID_VACC
    for place, name in ((0, "hacc"), (4, "hacc"), (8, "vacc")):
        records["covariance"][:, place] = np.where(known, fixes[name].astype(float) ** 2, 0.0)
    records["covariance_type"] = np.where(known, 2, 0)


class MapOrigin(NamedTuple):
    """The origin of the frame `map`: latitude, longitude (rad), height (m)."""

    lat: float
    lon: float
    height: float


def first_origin(states: Array) -> MapOrigin | None:
    """The first finite reference position, if possible one that is not 0, 0; None if there is none."""
    good = np.isfinite(states["lat"]) & np.isfinite(states["lon"]) & np.isfinite(states["height"])
    if not good.any():
        return None
    located = good & ((states["lat"] != 0.0) | (states["lon"] != 0.0))
    state = states[int(np.argmax(located if located.any() else good))]
    return MapOrigin(float(state["lat"]), float(state["lon"]), float(state["height"]))


def fill_pose(records: Array, states: Array, origin: MapOrigin) -> None:
    """Positions (m) and attitudes (quaternions) of states in the frame `map`.

    Attitudes are relative to north at the vehicle: the difference to north at the origin is ignored.
    """
    places = positions(states)
    north, east, down = displacement(origin, places["lat"], places["lon"], places["height"])
    records["x"], records["y"], records["z"] = east, north, -down
    phi, theta, psi = (states[name].astype(float) for name in ("phi", "theta", "psi"))
    attitude = quaternion_columns(phi, -theta, math.pi / 2.0 - psi)
    records["qw"], records["qx"], records["qy"], records["qz"] = attitude


def fill_odometry(records: Array, poses: Array, states: Array) -> None:
    """Velocities (m/s) and rates (rad/s) of states in the frame of the vehicle, with the `poses` of `fill_pose`."""
    for name in PLACE:
        records[name] = poses[name]
    for name in ("u", "p"):
        records[name] = states[name]
    for name in ("v", "w", "q", "r"):
        records[name] = -states[name].astype(float)


def quaternion_columns(phi: Array, theta: Array, psi: Array) -> tuple[Array, Array, Array, Array]:
    """w, x, y and z from columns of Euler angles (rad), as `quaternion_from_euler`."""
    roll, pitch, yaw = 0.5 * phi, 0.5 * theta, 0.5 * psi
    cr, sr, cp, sp, cy, sy = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch), np.cos(yaw), np.sin(yaw)
    w, x = cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy
    return w, x, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy


def log_body(time: int, entry: Any, name: str) -> bytearray:
    """A LOG of a LogBookEntry; time in ns."""
    body = bytearray(divmod(time, 1_000_000_000)[0].to_bytes(4, "little"))
    body += divmod(time, 1_000_000_000)[1].to_bytes(4, "little")
    body.append(LEVELS.get(entry.type, 20))
    for words in (name, entry.text, "", entry.context):
        body += bytes(-len(body) % 4) + cdr_string(words.encode("utf-8", "replace"))
    return body + bytes(-len(body) % 4) + bytes(4)


def image_body(time: int, frame: bytes, form: str, data: bytes) -> bytearray:
    """An IMAGE; time in ns."""
    seconds, rest = divmod(time, 1_000_000_000)
    body = bytearray(seconds.to_bytes(4, "little") + rest.to_bytes(4, "little"))
    for words in (frame, form.encode()):
        body += bytes(-len(body) % 4) + cdr_string(words)
    return body + bytes(-len(body) % 4) + len(data).to_bytes(4, "little") + data
