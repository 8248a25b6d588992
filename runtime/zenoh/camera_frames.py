"""Carries frames between the processes of a vehicle: through shared memory on one computer, else over the network.

They go beside the packets: at imc/<vehicle>/@frame/<camera>, the pixels as payload and all else as attachment.
"""

import contextlib
import queue
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, cast

import msgspec

from runtime.bus import Frame
from runtime.zenoh.config import LONGEST_FRAME, error_text
from runtime.zenoh.error_counter import ErrorCounter
from runtime.zenoh.key_expressions import PREFIX, key_chunk
from runtime.zenoh.session_factory import ADVICE, describe_lockable_memory

if TYPE_CHECKING:
    import zenoh

MOST_WAITING = 2  # frames; a slow process sees fewer of them, not older ones
MOST_CAMERAS = 64
POOL = 6  # frames in shared memory: those that wait on both sides, and those on the way
ENDING = 0.5  # s


Pixels = Annotated[int, msgspec.Meta(ge=1, le=65535)]


class FrameHeader(msgspec.Struct):
    """A frame without its pixels."""

    time: float
    camera: str
    index: int
    height: Pixels
    width: Pixels
    info: dict[str, float]


class ZenohFrames:
    """Sends the frames of one process to others that subscribe, and takes theirs; the oldest are dropped.

    `is_sibling` returns whether a session (zenoh id) runs another part of the vehicle: frames of others are rejected.
    """

    def __init__(self, vehicle: str, is_sibling: Callable[[str], bool], warn: Callable[[str], None]) -> None:
        self.malformed: ErrorCounter = ErrorCounter("that should be frames of this vehicle were dropped", warn)
        self.unsent: ErrorCounter = ErrorCounter("that are frames could not be sent", warn)
        self._place = f"{PREFIX}/{key_chunk(vehicle)}/@frame"
        self._is_sibling = is_sibling
        self._session: zenoh.Session | None = None
        self._publishers: dict[str, Any] = {}
        self._warn = warn
        self._shares = True
        self._pool: tuple[int, Any] = (0, None)
        self._waiting: queue.Queue[Frame | None] = queue.Queue(MOST_WAITING)
        self._subscriber: Any = None
        self._threads: list[threading.Thread] = []

    def open(self, session: "zenoh.Session", *, shares_memory: bool = True) -> None:
        self._session, self._shares = session, shares_memory

    def send(self, frame: Frame) -> None:
        """Send a frame soon, if another process subscribes to it; never waits."""
        publisher = self._publishers.get(frame.camera)
        if publisher is None:
            if self._session is None or len(self._publishers) >= MOST_CAMERAS:
                return
            publisher = self._publishers[frame.camera] = self._declare(self._session, frame.camera)
        if not publisher.matching_status.matching:
            return
        if not any(thread.name == "zenoh frames out" for thread in self._threads):
            self._begin("zenoh frames out", self._send)
        with contextlib.suppress(queue.Full):  # the receivers are slower than the camera
            self._waiting.put_nowait(frame)

    def subscribe(self, receive: Callable[[Frame], None]) -> None:
        """Take the frames of the other processes from now on; `receive` is called from a thread."""
        import zenoh

        if self._session is None or self._subscriber is not None:
            return
        self._subscriber = self._session.declare_subscriber(
            f"{self._place}/*", zenoh.handlers.RingChannel(MOST_WAITING), allowed_origin=zenoh.Locality.REMOTE
        )
        self._begin("zenoh frames in", self._read, self._subscriber.handler, receive)

    def close(self) -> None:
        self._session = None
        if self._subscriber is not None:
            self._subscriber.undeclare()
        with contextlib.suppress(queue.Empty):
            while True:
                self._waiting.get_nowait()
        self._waiting.put(None)
        for thread in self._threads:
            thread.join(ENDING)
        for publisher in self._publishers.values():
            publisher.undeclare()
        self._publishers.clear()
        self._pool = (0, None)

    def _declare(self, session: "zenoh.Session", camera: str) -> Any:
        import zenoh

        return session.declare_publisher(
            f"{self._place}/{key_chunk(camera)}",
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.DATA_LOW,
        )

    def _begin(self, name: str, function: Callable[..., None], *arguments: object) -> None:
        thread = threading.Thread(target=function, args=arguments, name=name, daemon=True)
        self._threads.append(thread)
        thread.start()

    def _send(self) -> None:
        import zenoh

        while (frame := self._waiting.get()) is not None:
            height, width, _ = frame.image.shape
            head = FrameHeader(frame.time, frame.camera, frame.index, height, width, frame.info)
            try:
                pixels = self._in_shared_memory(frame.image.tobytes())
                publisher = self._publishers[frame.camera]
                source = zenoh.SourceInfo(publisher.id, frame.index & 0xFFFFFFFF)
                began = time.monotonic()
                publisher.put(pixels, attachment=msgspec.msgpack.encode(head), source_info=source)
                if time.monotonic() - began >= LONGEST_FRAME / 1e6:  # zenoh has dropped it without a word
                    size, limit = frame.image.nbytes / 1e6, LONGEST_FRAME / 1e6
                    self.unsent.count(f"{frame.camera}: the network takes longer than {limit:g} s for {size:.3g} MB")
            except (zenoh.ZError, KeyError) as error:
                self.unsent.count(f"{frame.camera}: {error}")

    def _in_shared_memory(self, pixels: bytes) -> Any:
        """The pixels in a buffer that another process can read, or as they are if there is no room.

        What does not fit into the memory that may be locked is reported once, and not tried again with each frame.
        """
        import zenoh
        import zenoh.shm

        size, pool = self._pool
        if self._shares and size < len(pixels):
            try:
                pool = zenoh.shm.ShmProvider.default_backend(cast(Any, len(pixels) * POOL))
            except zenoh.ZError as error:
                self._shares, pool = False, None
                needed = f"{len(pixels) * POOL / 2**20:.3g} MB are needed, and {describe_lockable_memory()}"
                words = "frames go to other processes without shared memory, which is slower"
                self._warn(f"{words}: {needed}; {ADVICE} [{error_text(error)}]")
            self._pool = len(pixels), pool
        if pool is None or self._pool[0] < len(pixels):
            return pixels
        try:
            buffer = pool.alloc(len(pixels), policy=zenoh.shm.GarbageCollect())
        except zenoh.ZError:
            return pixels
        buffer[:] = pixels
        return buffer

    def _read(self, ring: "zenoh.handlers.Handler[zenoh.Sample]", receive: Callable[[Frame], None]) -> None:
        import zenoh

        while True:
            try:
                sample = ring.recv()
            except zenoh.ZError:
                return
            frame = self._taken(sample)
            if frame is not None and self._session is not None:
                receive(frame)

    def _taken(self, sample: "zenoh.Sample") -> Frame | None:
        """The frame of a sample; None, and counted, if it is none, or a stranger's."""
        source = sample.source_info
        try:
            if source is None or sample.attachment is None or not self._is_sibling(str(source.source_id.zid)):
                raise ValueError("not of a process of the vehicle")
            head = msgspec.msgpack.decode(sample.attachment.to_bytes(), type=FrameHeader)
            import numpy as np  # slow to import, and most sessions carry no frames

            pixels = np.frombuffer(sample.payload.to_bytes(), np.uint8)
            image = pixels.reshape(head.height, head.width, 4)
            return Frame(head.time, head.camera, head.index, image, head.info)
        except ValueError as error:  # msgspec's errors are ValueErrors, too
            self.malformed.count(f"{sample.key_expr}: {error}")
            return None
