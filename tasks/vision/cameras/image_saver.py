"""Pictures that cameras write to the log: times, folder and description."""

import importlib
import math
from functools import partial
from pathlib import Path
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

import imc
from imc.coordinates import absolute_position
from runtime import ParameterError, State, consume, param
from runtime.logs import resolve_log_folder
from runtime.profile import resolve_root_copy
from support.pose import Pose
from tasks.vision.cameras.camera_metadata import CAMERAS_FILE, write_cameras
from tasks.vision.cameras.picture_files import (
    FORMATS,
    ORDERS,
    parse_picture_request,
    photo_name,
    picture_event_data,
    write_picture,
)
from tasks.vision.cameras.picture_transmission import TransmittingCameraTask
from world.optics import CameraModel

Op = imc.LoggingControl.Op
PHOTOS_FOLDER = "Photos"  # of a log
SOON = 1e-3  # s by which a picture may be early
MOST_WAITING = 4  # pictures that wait for a slow disk, on a wall clock
MOVED = 1e-3  # m or rad by which a mount that is measured may waver


class PictureLocation(NamedTuple):
    """Estimated pose of the vehicle: latitude, longitude (rad), height (m); depth (m); roll, pitch, yaw (rad)."""

    place: tuple[float, float, float]
    depth: float
    angles: tuple[float, float, float]


class ImageSaverTask(TransmittingCameraTask):
    """A camera that writes pictures to the log: all of them, or those that Events ask for."""

    requires = "vision"
    transient: ClassVar[tuple[str, ...]] = (*TransmittingCameraTask.transient, "_folder", "_called", "_described")

    save_images: bool = param(
        False,
        "",
        "Write the images to the folder Photos of the log: <camera>_<number>_<s since 1970>.png.",
        visibility="user",
    )
    image_format: str = param(
        "PNG",
        "",
        "Of the images that are written: PNG and QOI keep each pixel; QOI is the fastest, JPEG the smallest.",
        choices=tuple(FORMATS),
    )

    @property
    def row_readout_time(self) -> float:
        """s from the first to the last row of a rolling shutter."""
        return 0.0

    @property
    def model_and_mount(self) -> tuple[CameraModel, Pose] | None:
        """The model of the camera and its mount, for cameras.yaml; None while they are not known."""
        return None

    def configure(self) -> None:
        """Reject a label whose pictures would have the names of another camera's. Raises ParameterError."""
        super().configure()
        own = photo_name(self.entity.label, 0, 0.0)
        for other in self.vehicle.tasks:
            if (
                other is not self
                and isinstance(other, ImageSaverTask)
                and photo_name(other.entity.label, 0, 0.0) == own
            ):
                reason = f"pictures of {self.entity.label!r} and {other.entity.label!r} would have the same names"
                raise ParameterError("Entity Label", reason)

    def start(self) -> None:
        super().start()
        if self.save_images:
            importlib.import_module("PIL.PngImagePlugin")
        self._wanted, self._period, self._next = 0.0, 0.0, self.now
        self._folder = self._called = self._log_root
        self._kept = self._writing = 0
        self.lost: int = 0
        self._unwritten = self._undescribed = self._counts = ""
        self._described: tuple[CameraModel, Pose] | None = None

    def after_restore(self) -> None:
        """Write images to the log that continues, not to the one of the snapshot."""
        self._folder = self._called = self.vehicle.log_folder or self._log_root
        self._described = None

    @consume
    def on_logging_control(self, log: imc.LoggingControl) -> None:
        """Write images to the folder of the log."""
        if log.op in (Op.STARTED, Op.CURRENT_NAME):
            called = self._log_root / log.name
            if called.resolve().is_relative_to(self._log_root.resolve()):
                virtual = self.vehicle.has_virtual_time
                self._keep_in(resolve_log_folder(called, self.vehicle.log_folder) if virtual else called, called)
            else:
                self.log.warning(f"images are not written to the log {log.name!r}, which is outside {self._log_root}")
        elif log.op == Op.STOPPED:
            self._keep_in(self._log_root, self._log_root)

    @consume(others=True)
    def on_picture_request(self, order: imc.Event) -> None:
        """Write the next images, as many and as often as asked for, or no more."""
        if order.topic not in ORDERS or self.system not in (order.src, order.dst):
            return
        try:
            series = parse_picture_request(order, self.entity.label)
        except ValueError as error:
            self.log.warning(f"{order.topic}: {error}")
            return
        if series is not None:
            importlib.import_module("PIL.PngImagePlugin")
            self._wanted, self._period = series
            self._next = self.now

    def resolve_parameter_path(self, name: str) -> Path:
        """A path of a parameter; a relative one counts from the profile, or else from the working folder.

        A run resumed from a snapshot has its profile elsewhere.
        """
        path = Path(name).expanduser()
        beside = self.vehicle.profile.base_folder / path
        return resolve_root_copy(beside if beside.exists() else path)

    def should_save(self, exposed: float | None = None) -> bool:
        """Whether to write the image that was exposed at a time (s since 1970), by default now."""
        time = self.now if exposed is None else exposed
        if not self._wanted or time < self._next - SOON:
            return self.save_images
        self._wanted -= 1
        self._next = max(self._next + self._period, time)
        return True

    def picture_location_from_state(self, state: imc.EstimatedState | None) -> PictureLocation:
        """The estimated pose in an Event "Picture"; NaN without a state."""
        nowhere = math.nan, math.nan, math.nan
        if state is None:
            return PictureLocation(nowhere, math.nan, nowhere)
        try:
            place = absolute_position(state)
        except (ArithmeticError, ValueError):
            place = nowhere  # an impossible latitude is no reason to lose the picture
        return PictureLocation(place, state.depth, (state.phi, state.theta, state.psi))

    def save(self, time: float, image: NDArray[np.uint8], described: PictureLocation) -> str:
        """Write a picture that was exposed at `time` (s since 1970); returns its file in the folder of the log.

        On a wall clock a picture is lost, and has no file, if the disk is too slow.
        """
        if self._writing >= MOST_WAITING and not self.vehicle.has_virtual_time:
            self._miss(f"{self._folder} is slower than the pictures")
            return ""
        file = f"{PHOTOS_FOLDER}/{photo_name(self.entity.label, self._kept, time, self.image_format)}"
        path = self._folder / file
        data = picture_event_data(self._within_logs(self._called / file), self._kept, time, *described)
        self._describe_cameras(path.parent)
        self._kept += 1
        self._writing += 1
        self.offload(write_picture, path, image, self.image_format, then=partial(self._written, data))
        return file

    def _keep_in(self, folder: Path, called: Path) -> None:
        """Write images to this folder, and publish it as `called`; in a new folder, their numbers start at 0."""
        if folder != self._folder:
            self._folder, self._called, self._kept, self._described = folder, called, 0, None

    def _describe_cameras(self, folder: Path) -> None:
        """Describe the cameras with the first picture, and when this one has changed.

        All cameras of the vehicle write the same file, so that it does not matter which of them is first.
        """
        own, before = self.model_and_mount, self._described
        if own is None or (not self._undescribed and before is not None and _same(own, before)):
            return
        if before is not None and not _same(own, before):
            self.log.warning(
                f"{CAMERAS_FILE} describes the camera from picture {self._kept} on; CameraFrame describes each"
            )
        self._described = own
        cameras = [task for task in self.vehicle.tasks if isinstance(task, ImageSaverTask)]
        known = {task.entity.label: camera for task in cameras if (camera := task.model_and_mount) is not None}
        readouts = {task.entity.label: task.row_readout_time for task in cameras}
        self.offload(write_cameras, folder, known, readouts, then=self._note_description)

    def _within_logs(self, path: Path) -> str:
        path, root = path.resolve(), self._log_root.resolve()
        return (path.relative_to(root) if path.is_relative_to(root) else path).as_posix()

    def report_entity_state(self, counts: str) -> None:
        """Report that frames come; while they cannot be written, this counts as a failure."""
        self._counts = counts
        if not (self._writing or self._wanted or self.save_images):
            self._unwritten = ""
        text = f"{counts}, {self.lost} pictures lost" if self.lost else counts
        if trouble := self._unwritten or self._undescribed:
            self.set_entity_state(State.FAILURE, f"{trouble}, {text}")
        else:
            self.set_entity_state(State.NORMAL, text)

    def _written(self, data: str, error: str) -> None:
        self._writing -= 1
        if error:
            self._miss(error)
            return
        self.publish(imc.Event(topic="Picture", data=data))
        if self._unwritten:
            self.log.info(f"pictures are written again; {self.lost} were lost")
        self._unwritten = ""

    def _miss(self, why: str) -> None:
        self.lost += 1
        if not self._unwritten:
            self.log.error(why)
        self._unwritten = why
        self.report_entity_state(self._counts)

    def _note_description(self, error: str) -> None:
        if error and not self._undescribed:
            self.log.error(error)
        self._undescribed = error

    @property
    def _log_root(self) -> Path:
        return self.vehicle.log_root / self.vehicle.name


def _same(one: tuple[CameraModel, Pose], other: tuple[CameraModel, Pose]) -> bool:
    return one[0] == other[0] and all(abs(a - b) < MOVED for a, b in zip(one[1], other[1], strict=True))
