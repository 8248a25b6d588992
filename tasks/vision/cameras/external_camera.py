"""Common parts of cameras whose pictures come from elsewhere: frames and their metadata."""

import math
from collections.abc import Mapping
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

import imc
from runtime import Frame, State, consume
from runtime.task import SharedOption
from support.log_limit import Trouble
from support.pose import Pose
from tasks.pose_history import PoseHistory
from tasks.simulated_world import world_of
from tasks.vision.cameras.camera_metadata import camera_frame_message
from tasks.vision.cameras.mounted_camera import MountedCameraTask
from world import SECTIONS
from world.optics import CameraModel, PinholeModel
from world.rendering import optical_to_body_transform

OLDEST = 1.0  # s, beyond which an EstimatedState is too old for a picture
MOST_HELD = 8  # pictures, which may be large
NOWHERE = np.full((4, 4), math.nan)


class _Picture(NamedTuple):
    """A picture that waits for a pose: the arguments of `deliver`."""

    time: float
    image: NDArray[np.uint8]
    stamp: float
    what: str


class ExternalCameraTask(MountedCameraTask):
    """Shares frames that somebody else has taken."""

    reads: ClassVar[Mapping[str, Mapping[str, SharedOption]]] = SECTIONS

    transient: ClassVar[tuple[str, ...]] = (*MountedCameraTask.transient, "_optics")

    def configure(self) -> None:
        super().configure()
        world_of(self)
        self._optics = self.read_calibration()

    @property
    def model_and_mount(self) -> tuple[CameraModel, Pose] | None:
        return None if self._optics is None else (self._optics, self.mount)

    def start(self) -> None:
        super().start()
        self.taken: int = 0
        self.dropped: int = 0
        self.failed: int = 0
        self.pose_history: PoseHistory = PoseHistory(world_of(self).origin)
        self._mismatch = Trouble()
        self._held = list[_Picture]()

    def count_lost(self, *, dropped: int = 0, failed: int = 0) -> None:
        """Add to the numbers of frames that came too late, and that could not be read."""
        self.dropped += dropped
        self.failed += failed

    @consume
    def on_estimated_state(self, state: imc.EstimatedState) -> None:
        self.pose_history.add(state)
        self.share_held()

    def deliver(self, time: float, image: NDArray[np.uint8], stamp: float, what: str = "") -> None:
        """Share a picture (height, width, 4) that was exposed at `time`, by its own clock at `stamp` (s).

        Just after a stall, in which nobody could publish a state, it is held until the next state says where it was
        taken, for at most `OLDEST` seconds.
        """
        unknown = self.pose_history.pose_at(time, OLDEST) is None and self.pose_history.latest_state is not None
        if not (self._held or (unknown and self.recent_stall)):
            self._share(time, image, stamp, what)
            return
        self._held.append(_Picture(time, image, stamp, what))
        if len(self._held) > MOST_HELD:
            self._share(*self._held.pop(0))
        if len(self._held) == 1:
            self.after(OLDEST, self.share_held)

    def share_held(self) -> None:
        """Share what is held, in its order, whether its pose is known or not."""
        held, self._held = self._held, []
        for picture in held:
            self._share(*picture)

    def _share(self, time: float, image: NDArray[np.uint8], stamp: float, what: str) -> None:
        height, width, _ = image.shape
        optics, counts = self._optics, f"{self.taken + 1} frames, {self.dropped} dropped, {self.failed} failed"
        if optics is not None and (optics.width, optics.height) != (width, height):
            mismatch = f"the calibration is for {optics.width} x {optics.height} px, not {width} x {height} px"
            self._mismatch.report(mismatch, self.log.warning)
            self.set_entity_state(State.FAULT, f"{mismatch}; {counts}")
            optics = None
        else:
            self.report_entity_state(f"{what}{counts}")
        mount = optical_to_body_transform(self.mount)
        estimate = self.pose_history.pose_at(time, OLDEST)
        there = NOWHERE if estimate is None else estimate.transform @ mount
        model = optics or PinholeModel(width, height, 1.0, 1.0, 0.5 * width, 0.5 * height)
        file = (
            self.save(time, image, self.picture_location_from_state(self.pose_history.latest_state))
            if self.should_save()
            else ""
        )
        message = camera_frame_message(
            time, self.taken, model, there, None if estimate is None else there, file, is_true=False
        )
        unknown = {} if optics else {"fx": math.nan, "fy": math.nan, "cx": math.nan, "cy": math.nan}
        self.share(Frame(time, self.entity.label, self.taken, image, {"stamp": stamp}, optics, mount))
        self.publish(message.replace(**unknown))
        self.taken += 1
