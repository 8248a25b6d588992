"""A real camera: of the computer (V4L2), or at a network address."""

import importlib.util
from collections.abc import Callable
from functools import partial

from runtime import ParameterError, State, param
from support.backoff import Backoff
from support.log_limit import Trouble
from tasks.vision.cameras.external_camera import ExternalCameraTask
from tasks.vision.cameras.image_sequence import Image, bgr_to_rgba, open_video

FIRST_RETRY, LAST_RETRY = 0.5, 5.0  # s


class Device(ExternalCameraTask):
    """Shares what a camera sees, at the camera's own rate, or at most `Frame Rate`.

    Of frames that come faster than they are handled, the newest counts. While the camera is missing, the entity is in
    ERROR and opening it is tried again, at least every 5 s.
    """

    external = True

    address: str = param(
        "",
        "",
        "/dev/video0, the number of a device, or an address of a stream that OpenCV reads: rtsp://, http://, udp://.",
        editable=False,
    )
    frame_rate: float = param(0.0, "Hz", "Most frames per second; 0 for all.", minimum=0, maximum=1000)
    width: int = param(0, "px", "Width to ask a device for; 0 for its own.", minimum=0, maximum=8192, editable=False)
    height: int = param(0, "px", "Height to ask a device for; 0 for its own.", minimum=0, maximum=8192, editable=False)
    timeout: float = param(
        5.0, "s", "Silence after which a stream is opened again.", minimum=0.1, maximum=60, editable=False
    )
    delay: float = param(0.0, "s", "Time from exposure to arrival.", minimum=0, maximum=60)

    def configure(self) -> None:
        super().configure()
        if not self.address:
            raise ParameterError("Address", "is not set")
        if importlib.util.find_spec("cv2") is None:
            raise ParameterError("Address", "a camera needs pip install opencv-python-headless")

    def start(self) -> None:
        super().start()
        self._backoff, self._last, self._trouble = Backoff(FIRST_RETRY, LAST_RETRY), self.now - 1e9, Trouble()
        self._open()
        self.set_entity_state(State.BOOT, f"opening {self.address}")

    def stop(self) -> None:
        self._feed.closed = True

    def _open(self) -> None:
        number = int(self.address) if self.address.isdecimal() else None
        address = self.address if number is None else number
        self._feed = feed = _FrameReader(address, (self.width, self.height), self.timeout)
        post = self.vehicle.kernel.post
        self.run_in_thread(partial(feed.run, partial(post, self._take, feed), partial(post, self._lose, feed)))

    def _take(self, feed: "_FrameReader") -> None:
        """Share the newest frame."""
        picture, feed.newest = feed.newest, None
        if feed is not self._feed or feed.closed or picture is None:
            return
        self.count_lost(dropped=feed.passed)
        feed.passed = 0
        if self._trouble.end():
            self.log.info(f"{self.address} sends again")
        self._backoff.reset()
        if self.frame_rate and self.now - self._last < 0.999 / self.frame_rate:
            return
        self._last = self.now
        self.deliver(self.now - self.delay, picture, self.now)

    def _lose(self, feed: "_FrameReader", why: str) -> None:
        if feed is not self._feed or feed.closed:
            return
        self.count_lost(failed=1)
        named = f"{self.address}: {why}"
        self._trouble.report(why, self.log.error, named)
        self.set_entity_state(State.ERROR, f"{named} ({self.failed} failed)")
        self.after(self._backoff.fail(), self._open)


class _FrameReader:
    """Reads a camera in a thread until it ends, or is `closed`. `passed` counts frames that were not taken in time."""

    def __init__(self, address: str | int, size: tuple[int, int], timeout: float):
        self.closed = False
        self.newest: Image | None = None
        self.passed = 0
        self._address, self._size, self._timeout = address, size, timeout

    def run(self, arrived: Callable[[], object], lost: Callable[[str], object]) -> None:
        try:
            why = self._read(arrived)
        except Exception as error:  # of OpenCV's, which has one class for all
            why = str(error)
        if not self.closed:
            lost(why)

    def _read(self, arrived: Callable[[], object]) -> str:
        """Returns why it has ended."""
        stream = isinstance(self._address, str) and "://" in self._address
        camera = open_video(self._address, self._timeout if stream else 0.0)
        if camera is None:
            return "cannot be opened"
        try:
            for setting, value in zip((3, 4), self._size, strict=True):  # CAP_PROP_FRAME_WIDTH and _HEIGHT
                if value:
                    camera.set(setting, value)
            while not self.closed:
                done, picture = camera.read()
                if not done:
                    return "no more frames"
                image, waits = bgr_to_rgba(picture), self.newest is not None
                self.newest = image
                if waits:
                    self.passed += 1
                else:
                    arrived()
            return "closed"
        finally:
            camera.release()
