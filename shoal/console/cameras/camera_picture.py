"""A picture of a camera, as a vehicle sends it: when and through which lens it was taken."""

import json
from functools import lru_cache
from typing import Any, NamedTuple, cast

import numpy as np

import imc
from shoal.logs.export import LoggedCamera
from support.number_parsing import finite_number
from support.picture_headers import PictureHeader, read_picture_header
from support.terminal_text import printable
from world.optics import CameraModel, parse_calibration

LONGEST_NAME = 64


class PictureLens(NamedTuple):
    """The description of a camera, and its model."""

    camera: LoggedCamera
    model: CameraModel


class CameraPicture(NamedTuple):
    """A picture: its time of exposure (s since 1970 UTC, by the clock of the vehicle), the label of its camera if it
    is in the picture, and its lens if that is known.
    """

    header: PictureHeader
    data: bytes
    time: float
    label: str = ""
    lens: PictureLens | None = None


def parse_picture(message: imc.CompressedImage) -> CameraPicture:
    """The picture in a message. Raises ValueError with the reason why it cannot be shown."""
    data = bytes(message.data)
    header = read_picture_header(data)
    metadata = _read_comment(header.comment)
    time, label, lens = metadata.get("time"), metadata.get("camera"), metadata.get("lens")
    seconds = finite_number(time)
    return CameraPicture(
        header,
        data,
        message.timestamp if seconds is None else seconds,
        printable(label)[:LONGEST_NAME] if isinstance(label, str) else "",
        _parse_lens(json.dumps(lens)) if isinstance(lens, dict) else None,
    )


def _read_comment(comment: bytes) -> dict[str, object]:
    """The object in the comment of a picture; empty for other comments."""
    if not comment.startswith(b"{"):
        return {}
    try:
        found = json.loads(comment)
    except (ValueError, RecursionError):
        return {}
    return cast(dict[str, object], found) if isinstance(found, dict) else {}


@lru_cache(maxsize=64)
def _parse_lens(text: str) -> PictureLens | None:
    """The camera in an entry of cameras.yaml, as JSON; None if its model is not known here."""
    try:
        metadata: dict[str, Any] = json.loads(text)
        pose = np.array(metadata.pop("T_BS"), float).reshape(4, 4)
        return PictureLens(LoggedCamera(metadata, pose), parse_calibration(json.dumps(metadata)))
    except (LookupError, TypeError, ValueError, ArithmeticError):
        return None
