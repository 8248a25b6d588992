"""The standard topics beside a camera's pictures: its calibration, its place in the vehicle, and what was detected."""

import struct
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

import imc
from shoal.console.cameras.camera_picture import CameraPicture, parse_picture
from shoal.console.cameras.detection_marks import Mark
from shoal.logs.export import (
    ANNOTATIONS,
    CAMERA_INFO,
    ENCAPSULATION,
    TRANSFORM,
    CdrError,
    LoggedCamera,
    MessageTopic,
    camera_info,
    encode_camera_transform,
    image_annotations,
    ros_name,
)

NO_LENS = "a picture without a lens that ROS has"


def camera_topics(
    system: str, camera: str, marks_of: Callable[[CameraPicture], list[Mark]]
) -> tuple[MessageTopic, ...]:
    """The topics of the pictures of a camera, named as in an MCAP export."""
    vehicle, frame = ros_name(system), f"{ros_name(system)}/{ros_name(camera)}"

    def encode_info(message: imc.Message, time: int) -> bytes:
        picture, info = _picture(message), b""
        with suppress(TypeError, ValueError, LookupError, ArithmeticError, struct.error):  # a lens of others
            info = camera_info(time, frame, _scaled(picture)) if picture.lens is not None else b""
        if not info:
            raise CdrError(NO_LENS)
        return ENCAPSULATION + info

    def encode_place(message: imc.Message, time: int) -> bytes:
        lens = _picture(message).lens
        if lens is None:
            raise CdrError(NO_LENS)
        return ENCAPSULATION + encode_camera_transform(time, vehicle, frame, lens.camera)

    def encode_marks(message: imc.Message, time: int) -> bytes:
        marks = [(mark["u"], mark["v"], mark["size"], mark["label"]) for mark in marks_of(_picture(message))]
        return ENCAPSULATION + image_annotations(time, marks)

    return (
        MessageTopic((system, camera, "camera_info"), CAMERA_INFO, encode_info),
        MessageTopic(("tf",), TRANSFORM, encode_place),
        MessageTopic((system, camera, "annotations"), ANNOTATIONS, encode_marks),
    )


def _picture(message: imc.Message) -> CameraPicture:
    if not isinstance(message, imc.CompressedImage):
        raise CdrError(NO_LENS)
    try:
        return parse_picture(message)
    except ValueError as error:
        raise CdrError(f"a picture is {error}") from None


def _scaled(picture: CameraPicture) -> LoggedCamera:
    """The camera with the pixels of the picture that was sent, whose first one has its center at (0, 0)."""
    assert picture.lens is not None
    model, camera = picture.lens.model, picture.lens.camera
    width, height = picture.header.width, picture.header.height
    if (width, height) == (model.width, model.height):
        return camera
    across, down = width / model.width, height / model.height

    def scaled(fx: float, fy: float, cx: float, cy: float) -> list[float]:
        return [fx * across, fy * down, (cx + 0.5) * across - 0.5, (cy + 0.5) * down - 0.5]

    values: dict[str, Any] = {**camera.model, "resolution": [width, height]}
    if values.get("camera_model") == "pinhole" and "intrinsics" in values:
        values["intrinsics"] = scaled(*values["intrinsics"])
    opencv: Mapping[str, Any] | None = values.get("opencv")
    if opencv is not None:
        (fx, _, cx), (_, fy, cy), _ = opencv["K"]
        fx, fy, cx, cy = scaled(fx, fy, cx, cy)
        values["opencv"] = {**opencv, "K": [[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]}
    return camera._replace(model=values)
