"""What cameras have in common whose pictures come from elsewhere: frames, and what is known of them."""

import math

import numpy as np
from numpy.typing import NDArray

import imc
from runtime import Frame, State, consume
from support.pose import Pose
from tasks.pose_history import Whereabouts
from tasks.simulated_world import world_of
from tasks.vision.cameras.camera_records import camera_frame
from tasks.vision.cameras.mounted_camera import MountedCamera
from world import SECTIONS
from world.optics import CameraModel, PinholeCamera
from world.rendering import optical

OLDEST = 1.0  # s, beyond which an EstimatedState says nothing of a picture
NOWHERE = np.full((4, 4), math.nan)


class CalibratedCamera(MountedCamera):
    """Shares frames that somebody else has taken."""

    reads = SECTIONS

    transient = (*MountedCamera.transient, "_optics")

    def configure(self) -> None:
        super().configure()
        world_of(self)
        self._optics = self.calibrated()

    @property
    def known(self) -> tuple[CameraModel, Pose] | None:
        return None if self._optics is None else (self._optics, self.mount)

    def start(self) -> None:
        super().start()
        self.taken = self.dropped = self.failed = 0
        self.whereabouts = Whereabouts(world_of(self).origin)
        self._odd = ""

    @consume
    def follow(self, state: imc.EstimatedState) -> None:
        self.whereabouts.follow(state)

    def deliver(self, time: float, image: NDArray[np.uint8], stamp: float, what: str = "") -> None:
        """Share a picture (height, width, 4) that was exposed at `time`, by its own clock at `stamp` (s)."""
        height, width, _ = image.shape
        optics, told = self._optics, f"{self.taken + 1} frames, {self.dropped} dropped, {self.failed} failed"
        if optics is not None and (optics.width, optics.height) != (width, height):
            odd = f"the calibration is for {optics.width} x {optics.height} px, not {width} x {height} px"
            if odd != self._odd:
                self._odd = odd
                self.log.warning(odd)
            self.set_entity_state(State.FAULT, f"{odd}; {told}")
            optics = None
        else:
            self.tell(f"{what}{told}")
        mount = optical(self.mount)
        estimate = self.whereabouts.pose(time, OLDEST)
        there = NOWHERE if estimate is None else estimate.transform @ mount
        model = optics or PinholeCamera(width, height, 1.0, 1.0, 0.5 * width, 0.5 * height)
        file = self.keep(time, image, self.described(self.whereabouts.latest)) if self.is_wanted() else ""
        message = camera_frame(time, self.taken, model, there, None if estimate is None else there, file, is_true=False)
        unknown = {} if optics else {"fx": math.nan, "fy": math.nan, "cx": math.nan, "cy": math.nan}
        self.share(Frame(time, self.entity.label, self.taken, image, {"stamp": stamp}, optics, mount))
        self.publish(message.replace(**unknown))
        self.taken += 1
