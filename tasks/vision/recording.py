"""A camera whose pictures were taken before."""

import importlib.util
from functools import partial
from typing import ClassVar

from runtime import ParameterError, State, param
from tasks.vision.cameras.external_camera import ExternalCameraTask
from tasks.vision.cameras.image_sequence import MOST_REPORTED, Image, ImageSequence, TimedImage, find_calibration
from world.optics import CalibrationError, read_calibration

FROM_START, AS_RECORDED = "From Start", "As Recorded"
LATE = 1.0  # s, beyond which a picture is left out on a wall clock


class Recording(ExternalCameraTask):
    """Shares pictures of a folder or a video at their times.

    A folder is a data set of EuRoC (mav0/cam0) or TUM (rgb.txt), the Photos of a log, or has pictures whose names are
    times in s or ns; a video needs OpenCV. Without `Calibration`, that of the folder counts, if there is one. A picture
    that is missing or broken is named, counted and left out.
    """

    transient: ClassVar[tuple[str, ...]] = (*ExternalCameraTask.transient, "_reel")

    source: str = param(
        "", "", "The folder or video; a relative path counts from the profile, or the working folder.", editable=False
    )
    camera: str = param(
        "", "", "Camera, if a folder has pictures of several: a label, cam1 of EuRoC, rgb1 of TUM.", editable=False
    )
    times: str = param(
        FROM_START,
        "",
        "From Start: the first picture comes when the vehicle starts, the others as long after it as they were taken; "
        "As Recorded: at their times since 1970.",
        choices=(FROM_START, AS_RECORDED),
        editable=False,
    )
    latency: float = param(0.0, "s", "Time from exposure to delivery.", minimum=0, maximum=60)

    def configure(self) -> None:
        super().configure()
        if not self.source:
            raise ParameterError("Source", "is not set")
        try:
            beside = find_calibration(self.resolve_parameter_path(self.source), self.camera)
        except (OSError, ValueError) as error:
            raise ParameterError("Camera", str(error)) from None
        if not self.calibration and (found := beside):
            try:
                self._optics = read_calibration(*found)
            except (CalibrationError, OSError) as error:
                self.after(0.0, self.log.warning, f"pictures without a calibration: {error}")
        if self.resolve_parameter_path(self.source).is_file():
            if importlib.util.find_spec("cv2") is None:
                raise ParameterError("Source", "a video needs pip install opencv-python-headless")
            if self.times == AS_RECORDED:
                raise ParameterError("Times", f"a video has no time of recording: use {FROM_START}")

    def start(self) -> None:
        super().start()
        self._number, self._began, self._first = 0, self.now, 0.0
        self._reel = ImageSequence(self.resolve_parameter_path(self.source), self.camera)
        self.set_entity_state(State.BOOT, f"opening {self.source}")
        self._fetch()

    def after_restore(self) -> None:
        super().after_restore()
        self._reel = ImageSequence(self.resolve_parameter_path(self.source), self.camera)

    def _fetch(self) -> None:
        """Read the next picture, before its time."""
        if self.times == AS_RECORDED:
            self.offload(self._reel.read, self._number, self.now - self.latency, then=self._plan)
        else:
            self.offload(self._reel.read, self._number, then=self._plan)

    def _plan(self, item: TimedImage | str | None) -> None:
        problems, self._reel.problems = self._reel.problems, []
        for problem in problems[:MOST_REPORTED]:
            self.log.warning(problem)
        self.count_lost(failed=len(problems))
        if item is None:
            self.share_held()
            counts = f"{self.taken} frames, {self.dropped} dropped, {self.failed} failed"
            if self.times == AS_RECORDED and not self._number:
                counts += "; all pictures are earlier than the run"
                self.log.warning(f"{self.source}: all pictures are earlier than the run: use Times = {FROM_START}")
            self.set_entity_state(State.NORMAL, f"{self.source} has ended: {counts}")
            return
        if isinstance(item, str):
            self.log.error(item)
            self.set_entity_state(State.ERROR, item)
            return
        if self.times == FROM_START and not item.number:
            self._first = item.time
        time = item.time if self.times == AS_RECORDED else self._began + (item.time - self._first)
        self._number = item.number + 1
        if item.image is None:
            self.count_lost(failed=1)
            if self.failed <= MOST_REPORTED:
                self.log.warning(f"left out: {item.error}")
            self.after(max(0.0, time - self.now), self._fetch)
        elif not self.vehicle.has_virtual_time and self.now - time - self.latency > LATE:
            self.count_lost(dropped=1)
            self._fetch()
        else:
            show = partial(self._show, time, item.image, item.time)
            self.after(max(0.0, time + self.latency - self.now), show)

    def _show(self, time: float, image: Image, stamp: float) -> None:
        self.deliver(time, image, stamp)
        self._fetch()
