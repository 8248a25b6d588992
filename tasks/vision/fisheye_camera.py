"""Simulates a fisheye camera that looks down from the vehicle."""

import importlib
import math
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import imc
from imc import coordinates
from runtime import Frame, ParameterError, State, Task, consume, param, periodic
from tasks.vision.photos import photo_name, write_png
from world.optics import PRESETS, Lens, Projection, preset_lens
from world.pictures import INTERPOLATIONS, SCENES, Camera, Pose, void_warning

Op = imc.LoggingControl.Op
LEAST_VISIBILITY = 0.1  # m


class FisheyeCamera(Task):
    """Shares frames of the seabed under a diving vehicle, or of the sea under a flying one, and of gliders on it.

    The top of the image looks to the bow. Gliders lie at `MUGs` north and east of where the vehicle is first seen. The
    seabed is at the altitude of EstimatedState, the sea at its altitude, or at z = 0 where it has none. A frame that is
    due while the one before is in the works is dropped and counted.
    """

    requires = "vision"

    frame_rate: float = param(5.0, "Hz", "Images per second.", minimum=0.01, maximum=1000)
    size: int = param(1024, "px", "Width and height of the image.", minimum=1, maximum=4096)
    face_size: int = param(
        512, "px", "Width of the views that the image is put together from.", minimum=1, maximum=4096
    )
    faces: int = param(5, "", "Number of these views; the sixth looks up.", choices=(5, 6))
    field_of_view: float = param(180.0, "°", "Angle between opposite points of the image's rim.")
    lens: str = param("equidistant", "", "Kind of lens.", choices=tuple(PRESETS))
    lens_coefficients: list[float] = param(
        [], "1", "k1 to k4 of r = k1 φ + k2 φ² + k3 φ³ + k4 φ⁴, φ in rad, in place of the kind's.", size=(0, 4)
    )
    focal_length: float = param(
        0.0,
        "px",
        "Pixels per unit of r: 1 for coefficients in px/radⁿ; 0 fits the field of view to the image.",
        minimum=0,
    )
    interpolation: str = param("nearest", "", "Between the pixels of a view.", choices=INTERPOLATIONS)
    scene: str = param("Seabed", "", "What is below the vehicle.", choices=SCENES)
    visibility: float = param(
        0.0,
        "m",
        "Distance at which 2 % of the contrast is left; 0 for 20 m in water, 20 km in air.",
        minimum=0,
        maximum=1e6,
    )
    mugs: list[str] = param(
        ["1.0 0.3"], "", 'North and east (m) of each glider, from the start: "1.0 0.3, 25 5".', name="MUGs"
    )
    save_images: bool = param(
        False, "", "Write the images as PNG to the folder Photos of the log: <camera>_<number>_<s since 1970>.png."
    )
    latency: float = param(0.05, "s", "Time from exposure to delivery on a virtual clock.", minimum=0, maximum=60)

    transient = ("camera",)

    def configure(self) -> None:
        if 0.0 < self.visibility < LEAST_VISIBILITY:
            raise ParameterError("Visibility", f"{self.visibility:g} m is neither 0 nor at least {LEAST_VISIBILITY} m")
        projection = self._projection()
        self.camera = Camera(
            projection,
            self.face_size,
            self.faces,
            self.interpolation,
            self.scene,
            self.visibility,
            self._gliders(),
            self.vehicle.seed,
        )
        self._info = {"fov": projection.lens.fov, "focal_length": projection.scale}
        warnings = [void_warning(projection.lens.fov, self.faces)]
        if projection.circle > self.size + 1e-6:
            warnings.append(f"the image circle of {projection.circle:.0f} px is cut off at {self.size} px")
        for text in filter(None, warnings):
            self.after(0.0, self.log.warning, text)  # at load, nobody hears yet

    def start(self) -> None:
        if self.save_images:
            importlib.import_module("PIL.PngImagePlugin")
        self.taken = self.dropped = 0
        self._busy = False
        self._folder, self._kept = self._log_root, 0
        self._state: imc.EstimatedState | None = None
        self._reference: tuple[float, float] | None = None
        self._start = (0.0, 0.0)
        self.set_entity_state(State.BOOT, "waiting for EstimatedState")

    @consume
    def follow(self, state: imc.EstimatedState) -> None:
        """Keep the state, and the start in the frame of its reference point, which may change."""
        self._state = state
        reference = state.lat, state.lon
        if not math.isfinite(state.lat + state.lon + state.x + state.y) or reference == self._reference:
            return
        if self._reference is None:
            self._start = state.x, state.y
        else:
            north, east, _ = coordinates.displacement(*reference, 0.0, *self._reference, 0.0)
            self._start = self._start[0] + north, self._start[1] + east
        self._reference = reference

    @consume
    def note_log(self, log: imc.LoggingControl) -> None:
        """Keep the images with the log."""
        if log.op in (Op.STARTED, Op.CURRENT_NAME):
            folder = (self._log_root / log.name).resolve()
            if folder.is_relative_to(self._log_root.resolve()):
                self._keep_in(folder)
            else:
                self.log.warning(f"the log {log.name!r} lies outside of {self._log_root}")
        elif log.op == Op.STOPPED:
            self._keep_in(self._log_root)

    @periodic("frame_rate")
    def expose(self) -> None:
        if self._state is None:
            return
        fault = self._fault(self._state)
        if fault:
            self.set_entity_state(State.FAULT, fault)
            return
        if self._busy:
            self.dropped += 1
            return
        pose = self._pose(self._state)
        frame = self.now, self.taken, self._describe(pose)
        path = None
        if self.save_images:
            path = self._folder / "Photos" / photo_name(self.entity.label, self._kept, self.now)
            self._kept += 1
        self.taken += 1
        self._busy = True
        self.offload(_shoot, self.camera, pose, path, then=partial(self._deliver, frame), latency=self.latency)

    def _keep_in(self, folder: Path) -> None:
        """Write images to this folder, and count them anew where it is another one."""
        if folder != self._folder:
            self._folder, self._kept = folder, 0

    def _deliver(self, frame: tuple[float, int, dict[str, float]], shot: tuple[NDArray[np.uint8], str]) -> None:
        self._busy = False
        image, error = shot
        time, index, info = frame
        self.share(Frame(time, self.entity.label, index, image, info))
        if error:
            self.set_entity_state(State.FAILURE, error)
        else:
            self.set_entity_state(State.NORMAL, f"{index + 1} frames, {self.dropped} dropped")

    def _fault(self, state: imc.EstimatedState) -> str:
        pose = state.lat + state.lon + state.x + state.y + state.z + state.phi + state.theta + state.psi + state.depth
        if not math.isfinite(pose):
            return "no position or attitude"
        return "" if self._height(state) > 0.0 else "no altitude"

    def _height(self, state: imc.EstimatedState) -> float:
        if 0.0 < state.alt < math.inf:
            return state.alt
        return -state.z if self.scene == "Sea Surface" else 0.0

    def _pose(self, state: imc.EstimatedState) -> Pose:
        return Pose(
            north=state.x - self._start[0],
            east=state.y - self._start[1],
            height=self._height(state),
            depth=state.depth,
            roll=state.phi,
            pitch=state.theta,
            yaw=state.psi,
            time=self.now - self.vehicle.start_time,
        )

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
                k1, k2, k3, k4 = self.lens_coefficients
                lens = Lens((k1, k2, k3, k4), fov)
            else:
                lens = preset_lens(self.lens, fov)
            return Projection(lens, self.size, self.focal_length)
        except ValueError as error:
            raise ParameterError(name, str(error)) from None

    def _gliders(self) -> tuple[tuple[float, float], ...]:
        words = " ".join(self.mugs).split()
        try:
            numbers = [float(word) for word in words]
        except ValueError:
            raise ParameterError("MUGs", f"{self.mugs} are not all numbers") from None
        if len(numbers) % 2 or not all(map(math.isfinite, numbers)):
            raise ParameterError("MUGs", f"{self.mugs} are not pairs of north and east")
        return tuple(zip(numbers[::2], numbers[1::2], strict=True))


def _shoot(camera: Camera, pose: Pose, path: Path | None) -> tuple[NDArray[np.uint8], str]:
    """The picture, and what kept it from being saved."""
    image = camera.picture(pose)
    return image, write_png(path, image) if path else ""
