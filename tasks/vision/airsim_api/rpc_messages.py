"""The messages of AirSim's interface: msgpack-rpc requests, and what answers contain. No input or output."""

import math
from typing import Any

import msgspec
import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

import world
from support.rotations import matrix_from_quaternion, quaternion_from_matrix, rotation
from world.optics import Floats
from world.rendering import optical_to_body_transform

Image = NDArray[np.uint8]

REQUEST, ANSWER = 0, 1
SCENE = 0  # of the types of images
COSYS = 2  # the first version of a server without cameras outside vehicles
LARGEST = 8192  # px of a side
SMALLEST = 1e-5  # of a scale of the projection, and of other terms beside it
FARTHEST = 1e9  # m, m/s, rad/s, beyond which a number is rubbish
PNG = b"\x89PNG"
SCALARS = {0xC0: 0, 0xC2: 0, 0xC3: 0, 0xCA: 4, 0xCB: 8, 0xCC: 1, 0xCD: 2, 0xCE: 4, 0xCF: 8} | {
    **dict(zip(range(0xD0, 0xD4), (1, 2, 4, 8), strict=True)),
    **dict(zip(range(0xD4, 0xD9), (2, 3, 5, 9, 17), strict=True)),
}
"""Bytes that follow the first one of msgpack's values of fixed size."""
BLOBS = {0xC4: 1, 0xC5: 2, 0xC6: 4, 0xC7: 1, 0xC8: 2, 0xC9: 4, 0xD9: 1, 0xDA: 2, 0xDB: 4}
"""Bytes of the length of those of any size."""
LISTS = {0xDC: (2, 1), 0xDD: (4, 1), 0xDE: (2, 2), 0xDF: (4, 2)}
"""Bytes of the count of lists and maps, and values per entry."""

OPTICAL = optical_to_body_transform(world.Pose())[:3, :3]


class AirSimError(Exception):
    """AirSim rejects a request, or sends an unusable answer."""


class AirSimVector(Struct):
    x_val: float
    y_val: float
    z_val: float


class AirSimQuaternion(Struct):
    w_val: float
    x_val: float
    y_val: float
    z_val: float


class AirSimPose(Struct):
    position: AirSimVector
    orientation: AirSimQuaternion


class Kinematics(Struct):
    """Place and velocity are north, east and down from where the vehicle began, rates are along its axes."""

    position: AirSimVector
    orientation: AirSimQuaternion
    linear_velocity: AirSimVector
    angular_velocity: AirSimVector

    def validate(self) -> None:
        """Raises AirSimError for a place, an attitude, a velocity or rates that cannot be."""
        pose_transform(self.position, self.orientation)
        for each in (self.linear_velocity, self.angular_velocity):
            if not all(abs(part) < FARTHEST for part in (each.x_val, each.y_val, each.z_val)):
                raise AirSimError(f"a motion that is none: {each}")


class GeoPoint(Struct):
    """Position in degrees, and m above the ellipsoid."""

    latitude: float
    longitude: float
    altitude: float

    def validate(self) -> None:
        """Raises AirSimError for a place that is none on Earth."""
        if not (abs(self.latitude) <= 90.0 and abs(self.longitude) <= 180.0 and abs(self.altitude) < FARTHEST):
            raise AirSimError(f"a place that is none: {self}")


class ProjectionMatrix(Struct):
    """Projection of the scene capture that takes pictures: its rows are across, down, depth and w of the picture."""

    matrix: list[list[float]]

    def scales(self) -> tuple[float, float] | None:
        """Focal lengths in halves of width and height; None for the matrix of no capture, which AirSim fills with NaN.

        They are the only terms of their rows, at [0][1] and [1][2] since AirSim's axes are forward, right, down, or on
        the diagonal. Raises AirSimError for a matrix that is none of a pinhole.
        """
        rows = [[abs(value) for value in row] for row in self.matrix[:2]]
        if len(rows) < 2 or any(len(row) != 4 for row in rows):
            raise AirSimError(f"proj_mat is no matrix: {self.matrix}")
        if any(math.isnan(value) for row in rows for value in row):
            return None
        across, down = (max(row) for row in rows)
        if not all(
            SMALLEST < max(row) < 1.0 / SMALLEST and math.fsum(row) <= max(row) * (1.0 + SMALLEST) for row in rows
        ):
            raise AirSimError(f"proj_mat is not that of a pinhole: {self.matrix}")
        return across, down


class CameraInfo(Struct):
    """`fov` (degrees) is left out: it is that of the viewer, not of the pictures."""

    pose: AirSimPose
    proj_mat: ProjectionMatrix | None = None


class ImageResponse(Struct):
    """A picture, where its camera was, and when (ns)."""

    image_data_uint8: bytes
    camera_position: AirSimVector
    camera_orientation: AirSimQuaternion
    time_stamp: int
    width: int
    height: int
    message: str = ""


class MessageEnd:
    """Finds the end of one msgpack value in bytes that arrive in portions."""

    def __init__(self) -> None:
        self._at = 0
        self._left = 1  # values that are still to come

    def is_complete(self, data: bytearray) -> bool:
        """Whether the value is there. Raises ValueError if more follows, or if it is no msgpack."""
        while self._left and self._at < len(data):
            size, inside = _head(data, self._at)
            if size is None:
                return False
            self._at += size
            self._left += inside - 1
        if not self._left and self._at < len(data):
            raise ValueError(f"{len(data) - self._at} bytes after the answer")
        return not self._left and self._at == len(data)


def _head(data: bytearray, at: int) -> tuple[int | None, int]:
    """The bytes of a value, without those that it contains, and how many it contains; None if more is to come."""
    first = data[at]
    if first <= 0x7F or first >= 0xE0:
        return 1, 0
    if first <= 0x8F:
        return 1, 2 * (first & 0x0F)
    if first <= 0x9F:
        return 1, first & 0x0F
    if first <= 0xBF:
        return 1 + (first & 0x1F), 0
    if first in SCALARS:
        return 1 + SCALARS[first], 0
    if first not in BLOBS and first not in LISTS:
        raise ValueError(f"0x{first:02x} is no msgpack")
    width = BLOBS[first] if first in BLOBS else LISTS[first][0]
    length = data[at + 1 : at + 1 + width]
    if len(length) < width:
        return None, 0
    count = int.from_bytes(length)
    if first in LISTS:
        return 1 + width, count * LISTS[first][1]
    return 1 + width + count + (0xC7 <= first <= 0xC9), 0


def encode_request(number: int, method: str, *parameters: Any) -> bytes:
    return msgspec.msgpack.encode([REQUEST, number, method, parameters])


def decode_answer(data: bytes | bytearray, number: int, kind: Any) -> Any:
    """The result of a request, as a value of `kind`. Raises AirSimError."""
    try:
        given, which, error, result = msgspec.msgpack.decode(data, type=tuple[int, int, Any, msgspec.Raw])
        if error is not None:
            raise AirSimError(_words(error))
        if (given, which) != (ANSWER, number):
            raise AirSimError(f"an answer of kind {given} to request {which} instead of {number}")
        return msgspec.msgpack.decode(result, type=kind)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as wrong:
        raise AirSimError(f"an answer that is not understood: {wrong}") from None


def _words(error: Any) -> str:
    text = error.get("message", error) if isinstance(error, dict) else error  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
    return " ".join(str(text).split())[:200]  # pyright: ignore[reportUnknownArgumentType]


def image_request(camera: str, *, compress: bool, cosys: bool) -> dict[str, Any]:
    asked = {"camera_name": camera, "image_type": SCENE, "pixels_as_float": False, "compress": compress}
    return asked | {"annotation_name": ""} if cosys else asked


def airsim_pose(place: tuple[float, float, float], angles: tuple[float, float, float]) -> AirSimPose:
    """Pose from north, east and down (m), and roll, pitch and yaw (rad)."""
    return AirSimPose(AirSimVector(*place), AirSimQuaternion(*quaternion_from_matrix(rotation(*angles))))


def pose_transform(position: AirSimVector, orientation: AirSimQuaternion) -> Floats:
    """(4, 4) from a body to north, east, down. Raises AirSimError for what is too far, or no rotation."""
    q = np.array([orientation.w_val, orientation.x_val, orientation.y_val, orientation.z_val])
    length = math.hypot(*q)
    found = np.eye(4)
    found[:3, 3] = position.x_val, position.y_val, position.z_val
    if not (np.abs(found).max() < FARTHEST and abs(length - 1.0) < 1e-2):
        raise AirSimError(f"a pose that is none: {position}, {orientation}")
    found[:3, :3] = matrix_from_quaternion((q / length).tolist())
    return found


def optical_pose(response: ImageResponse) -> Floats:
    """(4, 4) from the optical frame of the camera to north, east, down."""
    found = pose_transform(response.camera_position, response.camera_orientation)
    found[:3, :3] = found[:3, :3] @ OPTICAL
    return found


def decode_pixels(camera: str, response: ImageResponse) -> Image:
    """RGB (height, width, 3). Raises AirSimError for too few bytes, and impossible sizes."""
    data, width, height = response.image_data_uint8, response.width, response.height
    reason = f": {' '.join(response.message.split())[:100]}" if response.message else ""
    if not (1 <= width <= LARGEST and 1 <= height <= LARGEST):
        raise AirSimError(f"{camera}: a picture of {width} x {height} px{reason}")
    if data.startswith(PNG):
        return _decompressed(camera, data, width, height)
    depth = len(data) // (width * height)
    if depth not in (3, 4) or len(data) != depth * width * height:
        raise AirSimError(f"{camera}: {len(data)} bytes are no picture of {width} x {height} px{reason}")
    image = np.frombuffer(data, np.uint8).reshape(height, width, depth)
    # Three bytes are blue, green, red; four, of versions before 1.3, red, green, blue, alpha.
    return image[..., ::-1] if depth == 3 else image[..., :3]


def _decompressed(camera: str, data: bytes, width: int, height: int) -> Image:
    import io

    try:
        from PIL import Image as Pillow
    except ModuleNotFoundError:
        raise AirSimError("compressed pictures need pip install 'shoal[vision]'") from None
    try:
        with Pillow.open(io.BytesIO(data), formats=["PNG"]) as picture:
            if picture.size != (width, height):
                raise AirSimError(f"{camera}: a PNG of {picture.size}, announced as {width} x {height} px")
            return np.asarray(picture.convert("RGB"))
    except (OSError, ValueError, SyntaxError, EOFError, Pillow.DecompressionBombError) as error:
        raise AirSimError(f"{camera}: a damaged PNG: {error}") from None
