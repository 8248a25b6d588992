"""Common parts of all simulated cameras: exposures and frames."""

import importlib.util
from collections import deque
from collections.abc import Mapping
from functools import partial
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

import imc
from runtime import Frame, ParameterError, State, consume, param, periodic
from runtime.task import SharedOption
from support.pose import Pose
from tasks.simulated_world import world_of
from tasks.vision.cameras.camera_metadata import camera_frame_message
from tasks.vision.cameras.image_saver import ImageSaverTask, PictureLocation
from tasks.vision.cameras.viewpoint import PATIENCE, VehicleView, ViewpointTracker
from world import SECTIONS
from world.optics import CameraModel, Floats
from world.rendering import (
    INTERPOLATIONS,
    SCENES,
    Exposure,
    Lamp,
    SceneCamera,
    ScenePose,
    Shutter,
    frame_random,
    optical_to_body_transform,
    parse_lamp,
)

LEAST_VISIBILITY = 0.1  # m
ABOVE_WATER = 0.5  # m above the crests, from where a view under water gives a warning
ESTIMATED = "EstimatedState, since there is no SimulatedState"


class RenderedCameraTask(ImageSaverTask):
    """Shares frames of the seabed under a diving vehicle, or of the sea under a flying one, and of gliders."""

    reads: ClassVar[Mapping[str, Mapping[str, SharedOption]]] = SECTIONS

    frame_rate: float = param(5.0, "Hz", "Images per second.", minimum=0.01, maximum=1000, visibility="user")
    interpolation: str = param(
        "nearest",
        "",
        "Interpolation between the pixels of a view; opencv is bilinear, too, and differs by 1 here and there.",
        choices=INTERPOLATIONS,
    )
    scene: str = param("Seabed", "", "Scene below the vehicle.", choices=SCENES)
    visibility: float = param(
        0.0,
        "m",
        "Distance at which 2 % of the contrast is left for this camera; 0 for that of [World].",
        minimum=0,
        maximum=1e6,
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
    lamps: list[str] = param(
        [],
        "",
        "Lamps of the vehicle that this camera sees the light of: forward, right, down (m), pitch, yaw (°), flux (lm) "
        'and width of the beam (°): "0.6 0 0 -80 0 3000 70".',
    )
    latency: float = param(0.05, "s", "Time from exposure to delivery on a virtual clock.", minimum=0, maximum=60)

    transient: ClassVar[tuple[str, ...]] = (*ImageSaverTask.transient, "camera", "shutter")

    def camera_model(self) -> CameraModel:
        """The model of the camera. Raises ParameterError."""
        raise NotImplementedError

    @property
    def mount(self) -> Pose:
        """The pose of the camera in the vehicle."""
        raise NotImplementedError

    @property
    def row_readout_time(self) -> float:
        return self.readout_time

    @property
    def model_and_mount(self) -> tuple[CameraModel, Pose]:
        return self.camera.optics, self.mount

    def face_width_and_count(self) -> tuple[int, int]:
        """Width (px) and number of the views that make up an image; a width of 0 is as fine as the image."""
        raise NotImplementedError

    def configure(self) -> None:
        super().configure()
        if 0.0 < self.visibility < LEAST_VISIBILITY:
            raise ParameterError("Visibility", f"must be 0 or at least {LEAST_VISIBILITY} m, not {self.visibility:g} m")
        if self.interpolation == "opencv" and importlib.util.find_spec("cv2") is None:
            raise ParameterError("Interpolation", "opencv needs `pip install opencv-python-headless`")
        optics, world = self.camera_model(), world_of(self)
        self.camera: SceneCamera = SceneCamera(
            optics,
            *self.face_width_and_count(),
            self.interpolation,
            self.scene,
            self.visibility or (world.water_visibility if self.scene == "Seabed" else world.air_visibility),
            seed=self.vehicle.seed,
            waves=world.waves,
            sun=world.sun,
            mount=self.mount,
            water="" if self.visibility else world.water_type,
            lamps=self._lamps(),
            marine_snow=world.marine_snow,
            caustics=world.caustics,
            seabed=world.seabed,
            walls=world.walls,
        )
        self.shutter: Shutter = Shutter(self.camera, self._exposure())
        self._last_row = float(self.shutter.sample_times.max())

    def start(self) -> None:
        super().start()
        self.taken: int = 0
        self.dropped: int = 0
        self._busy, self._true, self._odd = False, True, False
        self._open = deque[tuple[float, imc.EstimatedState]]()
        self.viewpoint: ViewpointTracker = ViewpointTracker(
            world_of(self).origin, sea=self.scene == "Sea Surface", duration=self.readout_time + self.exposure_time
        )
        self.set_entity_state(State.BOOT, "waiting for EstimatedState")

    @consume
    def on_estimated_state(self, state: imc.EstimatedState) -> None:
        self.viewpoint.update_estimate(state)

    @consume
    def update_truth(self, truth: imc.SimulatedState) -> None:
        self.viewpoint.update_truth(truth)
        self._take_settled()

    @periodic("frame_rate")
    def expose(self) -> None:
        """Open the shutter; the picture is computed when it is known how the vehicle moved meanwhile."""
        if self.viewpoint.estimate is None:
            return
        self._open.append((self.now, self.viewpoint.estimate))
        self._take_settled()
        if self._open:
            self.after(self._last_row + PATIENCE, self._take_until, self.now)

    def _take_settled(self) -> None:
        """Take settled pictures; after a stall, wait for the states missing since then, as long as for any other."""
        while self._open and self.viewpoint.is_settled(
            self._open[0][0] + self._last_row, self.now, may_be_late=self.recent_stall > 0.0
        ):
            self.take(*self._open.popleft())

    def _take_until(self, time: float) -> None:
        while self._open and self._open[0][0] <= time:
            self.take(*self._open.popleft())

    def take(self, time: float, state: imc.EstimatedState) -> None:
        """Compute the picture that was exposed at a time (s since 1970), when `state` was the newest estimate."""
        view = self.viewpoint.view(world_of(self), time, self.vehicle.start_time)
        if isinstance(view, str):
            self.set_entity_state(State.FAULT, view)
            return
        if trouble := self.camera.obstruction(view.vehicle):
            self.set_entity_state(State.FAULT, trouble)
            return
        if (
            self._busy and not self.vehicle.has_virtual_time
        ):  # a latency alone does not keep a camera from the next exposure
            self.dropped += 1
            return
        if self._true is not view.is_true:
            self._true = view.is_true
            self.log.info(f"pictures are taken from {'SimulatedState' if view.is_true else ESTIMATED}")
        self._check_medium(view)
        described = self.picture_location_from_state(state) if self.should_save(time) else None
        deliver = partial(self._deliver, time, self.taken, view, self.model_and_mount, described)
        random = frame_random(self.vehicle.seed, self.entity.label, self.taken)
        self.taken += 1
        self._busy = True
        self.exposed: tuple[float, VehicleView] = time, view
        given = self.path(self.shutter.sample_times), view.gliders, random, view.boards
        latency = max(0.0, self.latency - (self.now - time))
        self.offload(self.shutter.take_picture, *given, then=deliver, latency=latency)

    def _check_medium(self, view: VehicleView) -> None:
        """Warn once of a camera in air that sees as under water; estimates may have no depth."""
        if self._odd or not view.is_true or self.scene != "Seabed":
            return
        above, world = -view.vehicle.at_mount(self.mount).depth, world_of(self)
        if above > ABOVE_WATER + (world.waves.height if world.waves_move_boats else 0.0):
            self._odd = True
            self.log.warning(f"the camera is {above:.1f} m above the water, but Scene = Seabed is the view under water")

    def path(self, times: Floats) -> list[ScenePose]:
        """The poses of the vehicle at times (s) from the last exposure; where they are unknown, it stays."""
        (exposed, view), world, began = self.exposed, world_of(self), self.vehicle.start_time
        path = list[ScenePose]()
        for seconds in times.tolist():
            moved = self.viewpoint.view(world, exposed + seconds, began) if seconds else view
            path.append(view.vehicle if isinstance(moved, str) else moved.vehicle)
        return path

    def _lamps(self) -> tuple[Lamp, ...]:
        try:
            return tuple(map(parse_lamp, self.lamps))
        except ValueError as error:
            raise ParameterError("Lamps", str(error)) from None

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

    def _deliver(
        self,
        time: float,
        index: int,
        view: VehicleView,
        camera: tuple[CameraModel, Pose],
        described: PictureLocation | None,
        image: NDArray[np.uint8],
    ) -> None:
        """Share a frame, and publish its description; the picture is written after that, to the same log.

        `camera` is as it was at the exposure.
        """
        self._busy = False
        optics, mount = camera[0], optical_to_body_transform(camera[1])
        pose = view.vehicle.pose.transform @ mount
        estimate = None if view.estimate is None else view.estimate.transform @ mount
        self.report_entity_state(
            f"{index + 1} frames, {self.dropped} dropped{'' if view.is_true else ', from EstimatedState'}"
        )
        self.share(
            Frame(time, self.entity.label, index, image, self.pose_and_lens_metadata(view, optics), optics, mount, pose)
        )
        file = self.save(time, image, described) if described else ""
        self.publish(camera_frame_message(time, index, optics, pose, estimate, file, is_true=view.is_true))

    def pose_and_lens_metadata(self, view: VehicleView, camera: CameraModel) -> dict[str, float]:
        """Angles in rad, lengths in m, the focal length in px, times in s."""
        vehicle = view.vehicle
        return {
            "focal_length": camera.fx,
            "readout_time": self.readout_time,
            "north": vehicle.north,
            "east": vehicle.east,
            "height": vehicle.height,
            "phi": vehicle.roll,
            "theta": vehicle.pitch,
            "psi": vehicle.yaw,
        }
