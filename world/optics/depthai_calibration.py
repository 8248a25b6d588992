"""The cameras of a calibration of DepthAI (OAK-D and others), in the terms of OpenCV."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from world.optics.camera_model import CalibrationError

SOCKETS = tuple(f"CAM_{letter}" for letter in "ABCDEFGH")
OLDER_NAMES: Mapping[str, str] = MappingProxyType({"rgb": "CAM_A", "left": "CAM_B", "right": "CAM_C"})
KINDS: Mapping[object, str] = MappingProxyType({0: "rational_polynomial", 1: "fisheye"})  # of cameraType
FISHEYE = 4  # of the 14 coefficients that are written for each lens

Values = Mapping[str, Any]


def is_depthai_calibration(values: Values) -> bool:
    return isinstance(values.get("cameraData"), list)


def depthai_cameras(values: Values) -> dict[str, Values]:
    """Read the entry of each camera in the file, by its socket, CAM_A for the first. Raises CalibrationError."""
    found: dict[str, Values] = {}
    for entry in values["cameraData"]:
        if not (isinstance(entry, list) and len(entry) == 2 and isinstance(entry[1], dict)):  # pyright: ignore[reportUnknownArgumentType]
            raise CalibrationError("cameraData has an entry that is not a socket and its camera")
        socket: Any = entry[0]  # pyright: ignore[reportUnknownVariableType]
        if not isinstance(socket, int) or not 0 <= socket < len(SOCKETS):
            raise CalibrationError(f"cameraData has the socket {socket!r}, not 0 to {len(SOCKETS) - 1}")
        found[SOCKETS[socket]] = entry[1]
    if not found:
        raise CalibrationError("cameraData has no cameras")
    return found


def depthai_terms(camera: Values) -> dict[str, Any]:
    """A camera as OpenCV describes it. Raises CalibrationError, also if it has not been calibrated."""
    for name in ("width", "height", "intrinsicMatrix", "distortionCoeff"):
        if name not in camera:
            raise CalibrationError(f"{name} is missing")
    kind, coefficients = camera.get("cameraType", 0), camera["distortionCoeff"]
    if not isinstance(kind, int) or isinstance(kind, bool) or kind not in KINDS:
        raise CalibrationError(f"cameraType {kind} is not supported; 0 (perspective) and 1 (fisheye) are")
    if not coefficients:
        raise CalibrationError("distortionCoeff is empty: the camera has not been calibrated")
    if KINDS[kind] == "fisheye" and isinstance(coefficients, list) and not any(coefficients[FISHEYE:]):  # pyright: ignore[reportUnknownArgumentType]
        coefficients = coefficients[:FISHEYE]  # pyright: ignore[reportUnknownVariableType]
    return {
        "image_width": camera["width"],
        "image_height": camera["height"],
        "intrinsicMatrix": camera["intrinsicMatrix"],
        "distortion_model": KINDS[kind],
        "distortionCoeff": coefficients,
    }
