"""Pictures that a camera sends to consoles, while one asks for them."""

import io
import json
import math
from functools import partial
from typing import Any, ClassVar

import numpy as np

import imc
from imc.reserved_ids import UNKNOWN_ENTITY
from runtime import Frame, Task, consume
from runtime.kernel import real_time_scale
from support.pose import Pose
from tasks.vision.cameras.camera_metadata import describe_camera
from world.optics import CameraModel
from world.rendering import optical_to_body_transform

ASKED = 5.0  # s of real time for which a request holds
MOST_RATE = 10  # Hz
EARLY = 0.1  # share of a period by which a frame may be early
QUALITY, POOR = 75, 40  # of JPEG, of 100; the poor one before a picture gets smaller
LONGEST_SIDE = 640  # px
LARGEST = 30_000  # bytes of a picture: less than a packet, and than what logs show at any time
SMALLEST_SIDE = 16  # px


class PictureRequests:
    """The rates and the quality that consoles have asked for; times in s of real time."""

    def __init__(self) -> None:
        self.quality: int = QUALITY
        self._until: dict[int, float] = {}

    def add(self, rate: int, quality: int, now: float) -> None:
        """Take a request for so many pictures a second; a quality of 0 is the usual one."""
        if rate:
            self._until[min(rate, MOST_RATE)] = now + ASKED
            self.quality = min(95, max(10, quality or QUALITY))

    def rate(self, now: float) -> int:
        """The highest rate (Hz) that somebody asks for now."""
        return max((rate for rate, until in self._until.items() if now < until <= now + ASKED), default=0)


class TransmittingCameraTask(Task):
    """A camera that publishes its pictures as CompressedImage while a console asks for them, and for 5 s after.

    ImageTxSettings asks, with frames per second (at most 10) and quality; its entity is the camera, or all. The
    pictures are JPEG of at most 640 px and 30 kB. The comment in each is JSON: `camera` (label), `time` of the exposure
    (s since 1970), `index` of the frame, and `lens`, its camera as in cameras.yaml; null if that is unknown.
    """

    transient: ClassVar[tuple[str, ...]] = ("_requests", "_lens")

    def configure(self) -> None:
        self._requests = PictureRequests()
        self._lens: tuple[Any, str] = (None, "")

    def start(self) -> None:
        self._encoding = False
        self._sent_at = -math.inf

    @consume(others=True)
    def on_picture_transmission_request(self, request: imc.ImageTxSettings) -> None:
        if request.dst == self.system and request.dst_ent in (self.entity.id, UNKNOWN_ENTITY):
            self._requests.add(request.fps, request.quality, self._real_time)

    @property
    def _real_time(self) -> float:
        return self.now / real_time_scale(self.vehicle.kernel.clock)

    def share(self, frame: Frame) -> None:
        """Share a frame, and send its picture if a console wants it now; one at a time."""
        self.publish_frame(frame)
        rate, since = self._requests.rate(self._real_time), self._real_time - self._sent_at
        if not rate or self._encoding or 0.0 <= since < (1.0 - EARLY) / rate:
            return
        self._encoding, self._sent_at = True, self._real_time
        camera = frame.optics, None if frame.mount is None else frame.mount.tobytes()
        if self._lens[0] != camera:
            self._lens = camera, ""
        then = partial(self._send, frame.index)
        self.offload(encode_picture, frame, self._requests.quality, self._lens[1], then=then)

    def _send(self, index: int, encoded: tuple[bytes, str]) -> None:
        picture, lens = encoded
        self._encoding, self._lens = False, (self._lens[0], lens)
        self.publish(imc.CompressedImage(frameid=index & 0xFF, data=picture))


def encode_picture(frame: Frame, quality: int, lens: str = "") -> tuple[bytes, str]:
    """A JPEG of a frame with at most LARGEST bytes, and the description of its lens (JSON) that is in it.

    `lens` is this description if it is known.
    """
    from PIL import Image

    lens = lens or json.dumps(_describe_lens(frame))
    metadata = {"camera": frame.camera, "time": round(frame.time, 6), "index": frame.index}
    comment = f'{json.dumps(metadata)[:-1]}, "lens": {lens}}}'.encode()
    picture, side = Image.fromarray(np.ascontiguousarray(frame.image[..., :3])), LONGEST_SIDE
    while True:
        picture.thumbnail((side, side))
        for attempt in (quality, POOR):
            data = io.BytesIO()
            picture.save(data, format="JPEG", quality=attempt, comment=comment)
            if data.tell() <= LARGEST or (side <= SMALLEST_SIDE and attempt == POOR):
                return data.getvalue(), lens
        side //= 2


def _describe_lens(frame: Frame) -> dict[str, Any] | None:
    """The camera of a frame as cameras.yaml has it; None if its lens or mount is unknown."""
    optics, mount = frame.optics, frame.mount
    height, width = frame.image.shape[:2]
    if not isinstance(optics, CameraModel) or mount is None or (optics.width, optics.height) != (width, height):
        return None
    place = Pose.from_transform(np.asarray(mount) @ np.linalg.inv(optical_to_body_transform(Pose())))
    return describe_camera(optics, place, frame.info.get("readout_time", 0.0))
