"""Pictures on disk, and the events that request and describe them."""

import io
import math
import re
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

import imc
from support.atomic_files import replace_file

TAKE, STOP = ORDERS = ("Take Pictures", "Stop Pictures")
COMPRESSION = 1  # of 9: a third of the time of the default 6, for files a fifth larger
QUALITY = 90  # of 100, of JPEG
FORMATS: Mapping[str, str] = MappingProxyType({"PNG": "png", "JPEG": "jpg", "QOI": "qoi"})
"""The ending of a file by its format."""


def photo_name(camera: str, index: int, time: float, kind: str = "PNG") -> str:
    """The name of picture `index` of a camera in its folder, taken at `time` (s since 1970 UTC)."""
    return f"{re.sub(r'[^A-Za-z0-9]+', '_', camera)}_{index:06d}_{time:.6f}.{FORMATS[kind]}"


def parse_picture_request(order: imc.Event, camera: str) -> tuple[float, float] | None:
    """The number of pictures that a camera is asked for, and the seconds between them; None if others are asked.

    `data` is "camera=LABEL;count=N;period=S": without a label all cameras are asked, and without a count one picture;
    0 means pictures until they are stopped. Raises ValueError with the reason.
    """
    given = dict(item.strip().split("=", 1) for item in order.data.split(";") if "=" in item)
    if given.get("camera", camera) != camera:
        return None
    if order.topic == STOP:
        return 0.0, 0.0
    count, period = (float(given.get(name, default)) for name, default in (("count", 1.0), ("period", 0.0)))
    if not (count >= 0.0 and count.is_integer() and 0.0 <= period < math.inf):
        raise ValueError(f"{order.data!r} asks for {count:g} pictures every {period:g} s")
    return count or math.inf, period


def picture_event_data(
    file: str, number: int, time: float, place: tuple[float, float, float], depth: float, angles: tuple[float, ...]
) -> str:
    """The data of the Event "Picture": `file` is below the folder of the vehicle's logs, angles are written in °.

    `place` is latitude and longitude (rad) and height above the ellipsoid (m), `angles` are roll, pitch and yaw (rad).
    """
    lat, lon, height = place
    roll, pitch, yaw = map(math.degrees, angles)
    where = f"lat={math.degrees(lat):.8f};lon={math.degrees(lon):.8f};height={height:.3f};depth={depth:.3f}"
    return f"file={file};number={number};time={time:.6f};{where};roll={roll:.3f};pitch={pitch:.3f};yaw={yaw:.3f}"


def write_picture(path: Path, image: NDArray[np.uint8], kind: str = "PNG") -> str:
    """Write an RGBA image in one of FORMATS; returns an error text, empty on success. The file contains no date.

    There is a whole file or none, also on a full disk.
    """
    from PIL import Image

    packed, picture = io.BytesIO(), Image.fromarray(image)
    if kind == "JPEG":
        picture.convert("RGB").save(packed, format=kind, quality=QUALITY)
    else:
        picture.save(packed, format=kind, **({"compress_level": COMPRESSION} if kind == "PNG" else {}))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replace_file(path, durable=False) as file:
            file.write(packed.getbuffer())
    except OSError as error:
        return f"cannot write {path}: {error.strerror or error}"
    return ""
