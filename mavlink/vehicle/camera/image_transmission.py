"""The last picture of a camera, small enough for a thin link, by MAVLink's image transmission protocol."""

from collections.abc import Mapping, Sequence
from functools import partial

from mavlink import ReceivedMessage, statustext
from mavlink.vehicle.camera.component import CameraComponent
from mavlink.vehicle.interfaces import Thumbnail
from mavlink.vehicle.session import Session

SIDE = 160  # px
QUALITY, BEST = 50, 95  # of JPEG
PIECE = 253  # bytes
JPEG = 1  # MAVLINK_DATA_STREAM_IMG_JPEG


class ImageTransmission:
    """Makes thumbnails, one at a time, and sends them to the stations that requested them."""

    def __init__(self, cameras: Sequence[CameraComponent]):
        self._cameras: Mapping[int, CameraComponent] = {camera.component: camera for camera in cameras}
        self._busy = False

    def receive(self, session: Session, message: ReceivedMessage, now: float) -> None:
        """Answer DATA_TRANSMISSION_HANDSHAKE, which names no component: the first camera with pictures does."""
        found = ((part, self._cameras[part.source.component]) for part in session.cameras)
        part, camera = next(((part, camera) for part, camera in found if camera.takes_pictures), (None, None))
        values = message.values
        if part is None or camera is None or self._busy or values["size"] or values["packets"]:
            return
        file = camera.latest_file
        if not file:
            part.send_statustext(statustext.WARNING, f"{camera.label} has taken no picture yet", now)
            return
        quality = min(values["jpg_quality"] or QUALITY, BEST)
        self._busy = True
        camera.pictures.make_thumbnail(file, SIDE, quality, partial(self._send, part, camera, quality, now))

    def _send(self, part: Session, camera: CameraComponent, quality: int, now: float, made: Thumbnail) -> None:
        self._busy = False
        if not made.jpeg:
            part.send_statustext(statustext.WARNING, f"{camera.label}: the picture cannot be read", now)
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
        part.start_list_transfer(sends, now)
