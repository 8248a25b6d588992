"""What all simulated cameras have in common: exposures, frames, pictures on disk."""

import importlib
import importlib.util
import math
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import imc
from imc.coordinates import absolute
from runtime import Frame, ParameterError, State, Task, consume, param, periodic
from tasks.surroundings import world_of
from tasks.vision.photos import FORMATS, ORDERS, describe_picture, photo_name, series_of, write_picture
from tasks.vision.records import camera_frame, write_cameras
from tasks.vision.viewpoint import View, Viewpoint
from world import SECTIONS, Pose
from world.optics import CameraModel
from world.pictures import INTERPOLATIONS, SCENES, Camera, Exposure, Shutter, Standpoint, noise, optical

Op = imc.LoggingControl.Op
LEAST_VISIBILITY = 0.1  # m
ESTIMATED = "EstimatedState, since there is no SimulatedState"
FOLDER = "Photos"  # of a log
SOON = 1e-3  # s by which a picture may be early


class RenderedCamera(Task):
    """Shares frames of the seabed under a diving vehicle, or of the sea under a flying one, and of gliders."""

    requires = "vision"
    reads = SECTIONS

    frame_rate: float = param(5.0, "Hz", "Images per second.", minimum=0.01, maximum=1000, visibility="user")
    interpolation: str = param(
        "nearest",
        "",
        "Interpolation between the pixels of a view; opencv is bilinear, too, and differs by 1 here and there.",
        choices=INTERPOLATIONS,
    )
    scene: str = param("Seabed", "", "What is below the vehicle.", choices=SCENES)
    visibility: float = param(
        0.0,
        "m",
        "Distance at which 2 % of the contrast is left for this camera; 0 for that of [World].",
        minimum=0,
        maximum=1e6,
    )
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
    exposure_time: float = param(
        0.0, "s", "How long motion smears an image; its brightness stays.", minimum=0, maximum=10
    )
    gain: float = param(1.0, "1", "Makes up for light that is missing: fewer photons.", minimum=1, maximum=1000)
    full_well: float = param(
        0.0, "1", "Electrons that are white at a gain of 1; 0 for no noise.", minimum=0, maximum=1e9
    )
    read_noise: float = param(0.0, "1", "Root mean square of electrons that are none.", minimum=0, maximum=1e6)
    vignetting: float = param(
        0.0, "1", "Share of light that the corner farthest from the middle loses.", minimum=0, maximum=1
    )
    motion_blur_samples: int = param(
        1, "1", "Instants within the exposure time whose mean an image is.", minimum=1, maximum=100
    )
    readout_time: float = param(0.0, "s", "From the first to the last row of a rolling shutter.", minimum=0, maximum=10)
    latency: float = param(0.05, "s", "Time from exposure to delivery on a virtual clock.", minimum=0, maximum=60)

    transient = ("camera", "shutter", "_folder")

    def optics(self) -> CameraModel:
        """The model of the camera. Raises ParameterError."""
        raise NotImplementedError

    @property
    def mount(self) -> Pose:
        """Where the camera is in the vehicle."""
        raise NotImplementedError

    def views(self) -> tuple[int, int]:
        """Width (px) and number of the views that make up an image; a width of 0 is as fine as the image."""
        raise NotImplementedError

    def configure(self) -> None:
        if 0.0 < self.visibility < LEAST_VISIBILITY:
            raise ParameterError("Visibility", f"must be 0 or at least {LEAST_VISIBILITY} m, not {self.visibility:g} m")
        if self.interpolation == "opencv" and importlib.util.find_spec("cv2") is None:
            raise ParameterError("Interpolation", "opencv needs `pip install opencv-python-headless`")
        optics, world = self.optics(), world_of(self)
        self.camera = Camera(
            optics,
            *self.views(),
            self.interpolation,
            self.scene,
            self.visibility or (world.water_visibility if self.scene == "Seabed" else world.air_visibility),
            seed=self.vehicle.seed,
            waves=world.waves,
            sun=world.sun,
            mount=self.mount,
            water="" if self.visibility else world.water_type,
        )
        self.shutter = Shutter(self.camera, self._exposure())

    def start(self) -> None:
        if self.save_images:
            importlib.import_module("PIL.PngImagePlugin")
        self.taken = self.dropped = 0
        self._busy, self._true = False, True
        self._wanted, self._period, self._next = 0.0, 0.0, self.now
        self._folder, self._kept = self._log_root, 0
        self.viewpoint = Viewpoint(world_of(self).origin, sea=self.scene == "Sea Surface")
        self.set_entity_state(State.BOOT, "waiting for EstimatedState")

    def restored(self) -> None:
        """Write images to the log that continues, not to the one of the snapshot."""
        self._folder = self.vehicle.log_folder or self._log_root

    @consume
    def follow(self, state: imc.EstimatedState) -> None:
        self.viewpoint.follow(state)

    @consume
    def follow_truth(self, truth: imc.SimulatedState) -> None:
        self.viewpoint.follow_truth(truth)

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

    def _is_wanted(self) -> bool:
        """Whether to write the image that is exposed now."""
        if not self._wanted or self.now < self._next - SOON:
            return self.save_images
        self._wanted -= 1
        self._next = max(self._next + self._period, self.now)
        return True

    @periodic("frame_rate")
    def expose(self) -> None:
        state = self.viewpoint.estimate
        if state is None:
            return
        view = self.viewpoint.view(world_of(self), self.now, self.vehicle.start_time)
        if isinstance(view, str):
            self.set_entity_state(State.FAULT, view)
            return
        if not view.vehicle.carried(self.mount).height > 0.0:
            self.set_entity_state(State.FAULT, "the camera is in the ground")
            return
        if self._busy and not self.vehicle.virtual:  # a latency alone does not keep a camera from the next exposure
            self.dropped += 1
            return
        if self._true is not view.true:
            self._true = view.true
            self.log.info(f"pictures are taken from {'SimulatedState' if view.true else ESTIMATED}")
        deliver = partial(
            self._deliver, self.now, self.taken, view, self._described(state) if self._is_wanted() else ()
        )
        random = noise(self.vehicle.seed, self.entity.label, self.taken)
        self.taken += 1
        self._busy = True
        given = self._path(view), view.gliders, random, view.boards
        self.offload(self.shutter.picture, *given, then=deliver, latency=self.latency)

    def _path(self, view: View) -> list[Standpoint]:
        """Where the vehicle is while the shutter is open, as it moves now; where that is not known, it stays."""
        world, began, path = world_of(self), self.vehicle.start_time, list[Standpoint]()
        for seconds in self.shutter.instants:
            moved = self.viewpoint.view(world, self.now + float(seconds), began) if seconds else view
            path.append(view.vehicle if isinstance(moved, str) else moved.vehicle)
        return path

    def _exposure(self) -> Exposure:
        if self.read_noise and not self.full_well:
            raise ParameterError("Full Well", "must be set with Read Noise")
        return Exposure(
            self.exposure_time,
            self.gain,
            self.full_well,
            self.read_noise,
            self.vignetting,
            self.motion_blur_samples,
            self.readout_time,
        )

    def _keep_in(self, folder: Path) -> None:
        """Write images to this folder; in a new folder, their numbers start at 0."""
        if folder != self._folder:
            self._folder, self._kept = folder, 0

    def _describe_cameras(self, folder: Path) -> None:
        """All cameras of the vehicle write the same file, so that it does not matter which of them is first."""
        cameras = [task for task in self.vehicle.tasks if isinstance(task, RenderedCamera)]
        known = {task.entity.label: (task.camera.optics, task.mount) for task in cameras}
        self.offload(write_cameras, folder, known, then=self._note_error)

    def _described(self, state: imc.EstimatedState) -> tuple[Any, ...]:
        """What an Event "Picture" says of where the vehicle believes to be."""
        try:
            place = absolute(state)
        except (ArithmeticError, ValueError):
            place = math.nan, math.nan, math.nan  # an impossible latitude is no reason to lose the picture
        return place, state.depth, (state.phi, state.theta, state.psi)

    def _within_logs(self, path: Path) -> str:
        path, root = path.resolve(), self._log_root.resolve()
        return (path.relative_to(root) if path.is_relative_to(root) else path).as_posix()

    def _deliver(
        self, time: float, index: int, view: View, described: tuple[Any, ...], image: NDArray[np.uint8]
    ) -> None:
        """Share a frame, and say what it is; a picture is written after that, to the log that says so."""
        self._busy = False
        mount = optical(self.mount)
        pose = view.vehicle.pose.transform @ mount
        estimate = None if view.estimate is None else view.estimate.transform @ mount
        optics, label, file = self.camera.optics, self.entity.label, ""
        self.set_entity_state(State.NORMAL, f"{index + 1} frames, {self.dropped} dropped")
        self.share(Frame(time, label, index, image, self._figures(view), optics, mount, pose))
        if described:
            file = f"{FOLDER}/{photo_name(label, self._kept, time, self.image_format)}"
            path = self._folder / file
            told = describe_picture(self._within_logs(path), self._kept, time, *described)
            if not self._kept:
                self._describe_cameras(path.parent)
            self._kept += 1
            self.offload(write_picture, path, image, self.image_format, then=partial(self._written, told))
        self.publish(camera_frame(time, index, optics, pose, estimate, file, is_true=view.true))

    def _written(self, told: str, error: str) -> None:
        if not error:
            self.publish(imc.Event(topic="Picture", data=told))
        self._note_error(error)

    def _note_error(self, error: str) -> None:
        if error:
            self.set_entity_state(State.FAILURE, error)

    def _figures(self, view: View) -> dict[str, float]:
        """Angles in rad, lengths in m, the focal length in px."""
        vehicle = view.vehicle
        return {
            "focal_length": self.camera.optics.fx,
            "north": vehicle.north,
            "east": vehicle.east,
            "height": vehicle.height,
            "phi": vehicle.roll,
            "theta": vehicle.pitch,
            "psi": vehicle.yaw,
        }

    @property
    def _log_root(self) -> Path:
        return self.vehicle.log_root / self.vehicle.name
