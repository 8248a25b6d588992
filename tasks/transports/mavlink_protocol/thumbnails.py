"""The last picture of a camera, small enough for a thin link, by MAVLink's image transmission protocol."""

import io
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple, Protocol

from mavlink import ReceivedMessage, statustext
from tasks.transports.mavlink_protocol.cameras import Camera
from tasks.transports.mavlink_protocol.session import Session

SIDE = 160  # px
QUALITY, BEST = 50, 95  # of JPEG
PIECE = 253  # bytes
JPEG = 1  # MAVLINK_DATA_STREAM_IMG_JPEG


class Thumbnail(NamedTuple):
    """`jpeg` is empty if there is none."""

    jpeg: bytes = b""
    width: int = 0
    height: int = 0


class Offload(Protocol):
    """Calls a function outside of the handlers, and `then` with its result."""

    def __call__(
        self, function: Callable[..., Thumbnail], *args: object, then: Callable[[Thumbnail], object]
    ) -> None: ...


class Studio:
    """Makes thumbnails, one at a time, and sends them to who has asked."""

    def __init__(self, offload: Offload):
        self._offload = offload
        self._busy = False

    def hear(self, session: Session, message: ReceivedMessage, now: float) -> None:
        """Answer DATA_TRANSMISSION_HANDSHAKE, which names no component: the first camera with pictures does."""
        part = next((p for p in session.cameras if p.camera is not None and p.camera.takes_pictures), None)
        values = message.values
        if part is None or part.camera is None or self._busy or values["size"] or values["packets"]:
            return
        path = part.camera.latest_file
        if path is None:
            part.say(statustext.WARNING, f"{part.camera.label} has taken no picture yet", now)
            return
        quality = min(values["jpg_quality"] or QUALITY, BEST)
        self._busy = True
        self._offload(shrink, path, quality, then=partial(self._send, part, part.camera, quality, now))

    def _send(self, part: Session, camera: Camera, quality: int, now: float, made: Thumbnail) -> None:
        self._busy = False
        if not made.jpeg:
            part.say(statustext.WARNING, f"{camera.label}: the picture cannot be read", now)
            return
        pieces = [made.jpeg[start : start + PIECE] for start in range(0, len(made.jpeg), PIECE)]
        about = {"type": JPEG, "size": len(made.jpeg), "width": made.width, "height": made.height}
        part.send(
            "DATA_TRANSMISSION_HANDSHAKE", {**about, "packets": len(pieces), "payload": PIECE, "jpg_quality": quality}
        )
        sends = [
            partial(part.send, "ENCAPSULATED_DATA", {"seqnr": number, "data": list(piece)})
            for number, piece in enumerate(pieces)
        ]
        part.send_all(sends, now)


def shrink(path: Path, quality: int) -> Thumbnail:
    """A JPEG of a picture, at most SIDE pixels wide and high."""
    try:
        from PIL import Image

        with Image.open(path) as picture:
            picture.thumbnail((SIDE, SIDE))
            made = io.BytesIO()
            picture.convert("RGB").save(made, format="JPEG", quality=quality)
            return Thumbnail(made.getvalue(), *picture.size)
    except (ImportError, OSError, ValueError):
        return Thumbnail()
