"""Simulates a fisheye camera that looks down from the vehicle."""

import importlib
import importlib.util
import math
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import imc
from imc.coordinates import absolute
from runtime import Frame, ParameterError, State, Task, consume, param, periodic
from tasks.surroundings import check_older, world_of
from tasks.vision.photos import ORDERS, describe_picture, photo_name, series_of, write_png
from tasks.vision.viewpoint import View, Viewpoint
from world import SECTIONS
from world.optics import PRESETS, Lens, Projection, preset_lens
from world.pictures import INTERPOLATIONS, SCENES, Camera, Pose, void_warning

Op = imc.LoggingControl.Op
LEAST_VISIBILITY = 0.1  # m
ESTIMATED = "EstimatedState, since there is no SimulatedState"
SOON = 1e-3  # s by which a picture may be early


class FisheyeCamera(Task):
    """Shares frames of the seabed under a diving vehicle, or of the sea under a flying one, and of gliders.

    The top of the image points to the bow. Bottom, gliders, water and sun are those of [World]. The camera is where
    the vehicle really is at the exposure: SimulatedState. Without it, it is where EstimatedState is, and the entity
    says so; the altitude is then the height above seabed or sea; without it, the sea is at z = 0. On a wall clock, a
    frame that is due while the previous one is still computed is dropped and counted. Each picture that is written is
    told by an Event "Picture"; Events "Take Pictures" and "Stop Pictures" ask for some.
    """

    requires = "vision"
    reads = SECTIONS

    frame_rate: float = param(5.0, "Hz", "Images per second.", minimum=0.01, maximum=1000, visibility="user")
    size: int = param(1024, "px", "Width and height of the image.", minimum=1, maximum=4096)
    face_size: int = param(512, "px", "Width of the views that make up the image.", minimum=1, maximum=4096)
    faces: int = param(5, "", "Number of views; the sixth looks up.", choices=(5, 6))
    field_of_view: float = param(180.0, "°", "Angle between opposite points of the image's rim.")
    lens: str = param("equidistant", "", "Kind of lens.", choices=tuple(PRESETS))
    lens_coefficients: list[float] = param(
        [], "1", "k1 to k4 of r = k1 φ + k2 φ² + k3 φ³ + k4 φ⁴, φ in rad; they replace those of the lens.", size=(0, 4)
    )
    focal_length: float = param(
        0.0,
        "px",
        "Pixels per unit of r: 1 for coefficients in px/radⁿ; 0 fits the field of view to the image.",
        minimum=0,
    )
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
    mugs: list[str] = param(["1.0 0.3"], "", "Older place of [World] Gliders, which all cameras see.", name="MUGs")
    save_images: bool = param(
        False,
        "",
        "Write the images as PNG to the folder Photos of the log: <camera>_<number>_<s since 1970>.png.",
        visibility="user",
    )
    latency: float = param(0.05, "s", "Time from exposure to delivery on a virtual clock.", minimum=0, maximum=60)

    transient = ("camera", "_folder")

    def configure(self) -> None:
        if 0.0 < self.visibility < LEAST_VISIBILITY:
            raise ParameterError("Visibility", f"must be 0 or at least {LEAST_VISIBILITY} m, not {self.visibility:g} m")
        if self.interpolation == "opencv" and importlib.util.find_spec("cv2") is None:
            raise ParameterError("Interpolation", "opencv needs `pip install opencv-python-headless`")
        projection, world = self._projection(), world_of(self)
        check_older(self, "MUGs")
        self.camera = Camera(
            projection,
            self.face_size,
            self.faces,
            self.interpolation,
            self.scene,
            self.visibility or (world.water_visibility if self.scene == "Seabed" else world.air_visibility),
            seed=self.vehicle.seed,
            waves=world.waves,
            sun=world.sun,
        )
        self._info = {"fov": projection.lens.fov, "focal_length": projection.scale}
        warnings = [void_warning(projection.lens.fov, self.faces)]
        if projection.circle > self.size + 1e-6:
            warnings.append(f"the image circle of {projection.circle:.0f} px is cut off at {self.size} px")
        for text in filter(None, warnings):
            self.after(0.0, self.log.warning, text)  # later: at load, no task receives messages yet

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
        if self._busy and not self.vehicle.virtual:  # a latency alone does not keep a camera from the next exposure
            self.dropped += 1
            return
        frame = self.now, self.taken, self._describe(view.pose)
        if self._true is not view.true:
            self._true = view.true
            self.log.info(f"pictures are taken from {'SimulatedState' if view.true else ESTIMATED}")
        path, told = None, ""
        if self._is_wanted():
            path = self._folder / "Photos" / photo_name(self.entity.label, self._kept, self.now)
            told = self._tell(path, state)
            self._kept += 1
        self.taken += 1
        self._busy = True
        self.offload(_shoot, self.camera, view, path, then=partial(self._deliver, frame, told), latency=self.latency)

    def _keep_in(self, folder: Path) -> None:
        """Write images to this folder; in a new folder, their numbers start at 0."""
        if folder != self._folder:
            self._folder, self._kept = folder, 0

    def _tell(self, path: Path, state: imc.EstimatedState) -> str:
        """Where and when a picture is taken."""
        path, root = path.resolve(), self._log_root.resolve()
        file = (path.relative_to(root) if path.is_relative_to(root) else path).as_posix()
        try:
            place = absolute(state)
        except (ArithmeticError, ValueError):
            place = math.nan, math.nan, math.nan  # an impossible latitude is no reason to lose the picture
        return describe_picture(file, self._kept, self.now, place, state.depth, (state.phi, state.theta, state.psi))

    def _deliver(
        self, frame: tuple[float, int, dict[str, float]], told: str, shot: tuple[NDArray[np.uint8], str]
    ) -> None:
        self._busy = False
        image, error = shot
        time, index, info = frame
        self.share(Frame(time, self.entity.label, index, image, info))
        if told and not error:
            self.publish(imc.Event(topic="Picture", data=told))
        if error:
            self.set_entity_state(State.FAILURE, error)
        else:
            self.set_entity_state(State.NORMAL, f"{index + 1} frames, {self.dropped} dropped")

    def _describe(self, pose: Pose) -> dict[str, float]:
        """Angles in rad, lengths in m, the focal length in px."""
        return {
            **self._info,
            "north": pose.north,
            "east": pose.east,
            "height": pose.height,
            "phi": pose.roll,
            "theta": pose.pitch,
            "psi": pose.yaw,
        }

    @property
    def _log_root(self) -> Path:
        return self.vehicle.log_root / self.vehicle.name

    def _projection(self) -> Projection:
        fov = math.radians(self.field_of_view)
        name = "Field of View"
        try:
            if self.lens_coefficients:
                name = "Lens Coefficients" if 0.0 < self.field_of_view <= 360.0 else name
                lens = Lens(tuple(self.lens_coefficients), fov)
            else:
                lens = preset_lens(self.lens, fov)
            return Projection(lens, self.size, self.focal_length)
        except ValueError as error:
            raise ParameterError(name, str(error)) from None


def _shoot(camera: Camera, view: View, path: Path | None) -> tuple[NDArray[np.uint8], str]:
    """The picture, and an error text if it could not be saved."""
    image = camera.picture(view.pose, view.gliders)
    return image, write_png(path, image) if path else ""
