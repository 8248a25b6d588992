"""Pictures that cameras write to the log: when, where to, and what is told of them."""

import importlib
import math
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import imc
from imc.coordinates import absolute
from runtime import State, Task, consume, param
from tasks.vision.photos import FORMATS, ORDERS, describe_picture, photo_name, series_of, write_picture
from tasks.vision.records import write_cameras
from world import Pose
from world.optics import CameraModel

Op = imc.LoggingControl.Op
FOLDER = "Photos"  # of a log
SOON = 1e-3  # s by which a picture may be early


class Described(NamedTuple):
    """Where the vehicle believes to be: latitude, longitude (rad), height (m); depth (m); roll, pitch, yaw (rad)."""

    place: tuple[float, float, float]
    depth: float
    angles: tuple[float, float, float]


class PictureKeeper(Task):
    """A camera that writes pictures to the log: all of them, or those that Events ask for."""

    requires = "vision"
    transient = ("_folder",)

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
    def known(self) -> tuple[CameraModel, Pose] | None:
        """The model of the camera and its mount, for cameras.yaml; None while they are not known."""
        return None

    def start(self) -> None:
        if self.save_images:
            importlib.import_module("PIL.PngImagePlugin")
        self._wanted, self._period, self._next = 0.0, 0.0, self.now
        self._folder: Path = self._log_root
        self._kept = self.lost = 0
        self._unwritten, self._undescribed = "", False

    def restored(self) -> None:
        """Write images to the log that continues, not to the one of the snapshot."""
        self._folder = self.vehicle.log_folder or self._log_root

    @consume
    def note_log(self, log: imc.LoggingControl) -> None:
        """Write images to the folder of the log."""
        if log.op in (Op.STARTED, Op.CURRENT_NAME):
            folder = (self._log_root / log.name).resolve()
            if folder.is_relative_to(self._log_root.resolve()):
                self._keep_in(folder)
            else:
                self.log.warning(f"images are not written to the log {log.name!r}, which is outside {self._log_root}")
        elif log.op == Op.STOPPED:
            self._keep_in(self._log_root)

    @consume(others=True)
    def take_pictures(self, order: imc.Event) -> None:
        """Write the next images, as many and as often as asked for, or no more."""
        if order.topic not in ORDERS or self.system not in (order.src, order.dst):
            return
        try:
            series = series_of(order, self.entity.label)
        except ValueError as error:
            self.log.warning(f"{order.topic}: {error}")
            return
        if series is not None:
            importlib.import_module("PIL.PngImagePlugin")
            self._wanted, self._period = series
            self._next = self.now

    def path_of(self, name: str) -> Path:
        """A path of a parameter; a relative one counts from the profile, or else from the working folder.

        A run that goes on from a snapshot has its profile elsewhere.
        """
        path = Path(name).expanduser()
        beside = self.vehicle.profile.folder / path
        return beside if beside.exists() else path

    def is_wanted(self) -> bool:
        """Whether to write the image that is exposed now."""
        if not self._wanted or self.now < self._next - SOON:
            return self.save_images
        self._wanted -= 1
        self._next = max(self._next + self._period, self.now)
        return True

    def described(self, state: imc.EstimatedState | None) -> Described:
        """What an Event "Picture" says of where the vehicle believes to be; NaN without a state."""
        nowhere = math.nan, math.nan, math.nan
        if state is None:
            return Described(nowhere, math.nan, nowhere)
        try:
            place = absolute(state)
        except (ArithmeticError, ValueError):
            place = nowhere  # an impossible latitude is no reason to lose the picture
        return Described(place, state.depth, (state.phi, state.theta, state.psi))

    def keep(self, time: float, image: NDArray[np.uint8], described: Described) -> str:
        """Write a picture that was exposed at `time` (s since 1970); returns its file in the folder of the log."""
        file = f"{FOLDER}/{photo_name(self.entity.label, self._kept, time, self.image_format)}"
        path = self._folder / file
        told = describe_picture(self._within_logs(path), self._kept, time, *described)
        if not self._kept or self._undescribed:
            self._describe_cameras(path.parent)
        self._kept += 1
        self.offload(write_picture, path, image, self.image_format, then=partial(self._written, told))
        return file

    def _keep_in(self, folder: Path) -> None:
        """Write images to this folder; in a new folder, their numbers start at 0."""
        if folder != self._folder:
            self._folder, self._kept = folder, 0

    def _describe_cameras(self, folder: Path) -> None:
        """All cameras of the vehicle write the same file, so that it does not matter which of them is first."""
        cameras = [task for task in self.vehicle.tasks if isinstance(task, PictureKeeper)]
        known = {task.entity.label: camera for task in cameras if (camera := task.known) is not None}
        self.offload(write_cameras, folder, known, then=self._described)

    def _described(self, error: str) -> None:
        self._undescribed = bool(error)
        self._note_error(error)

    def _within_logs(self, path: Path) -> str:
        path, root = path.resolve(), self._log_root.resolve()
        return (path.relative_to(root) if path.is_relative_to(root) else path).as_posix()

    def tell(self, counts: str) -> None:
        """That frames come; while they cannot be written, this counts as a failure."""
        if self._unwritten:
            self.set_entity_state(State.FAILURE, f"{self._unwritten}, {counts}")
        else:
            self.set_entity_state(State.NORMAL, counts)

    def _written(self, told: str, error: str) -> None:
        if error:
            self.lost += 1
        else:
            self.publish(imc.Event(topic="Picture", data=told))
            if self._unwritten:
                self.log.info(f"pictures are written again; {self.lost} were lost")
            self._unwritten = ""
        self._note_error(error)

    def _note_error(self, error: str) -> None:
        if error:
            if not self._unwritten:
                self.log.error(error)
            self._unwritten = f"{error} ({self.lost} pictures lost)"
            self.set_entity_state(State.FAILURE, self._unwritten)

    @property
    def _log_root(self) -> Path:
        return self.vehicle.log_root / self.vehicle.name
