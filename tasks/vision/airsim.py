"""Cameras that AirSim, Colosseum or Cosys-AirSim renders."""

import json
import math
from collections.abc import Mapping
from functools import partial
from typing import ClassVar, NamedTuple

import numpy as np

import imc
from runtime import Frame, ParameterError, State, consume, param, periodic
from runtime.task import SharedOption
from support.backoff import Backoff
from support.log_limit import Trouble
from support.pose import Pose
from support.rotations import to_body
from tasks.pose_history import PoseHistory
from tasks.simulated_world import TrueState, world_of
from tasks.true_motion import simulated_state
from tasks.vision.airsim_api.client import AirSimCapture, AirSimClient, mount_from_poses
from tasks.vision.airsim_api.rpc_messages import AirSimError, Image, Kinematics, pose_transform
from tasks.vision.cameras.camera_metadata import camera_frame_message
from tasks.vision.cameras.image_saver import ImageSaverTask
from tasks.vision.cameras.mounted_camera import INLINE, NO_VALUE
from world import SECTIONS
from world.optics import (
    LENS_PRESETS,
    CameraModel,
    FisheyeModel,
    Floats,
    PinholeModel,
    parse_airsim_settings,
    preset_lens,
)
from world.rendering import INTERPOLATIONS, CubeMapAssembler, optical_to_body_transform, uncovered_warning

OLDEST = 1.0  # s, beyond which a state counts as missing
FIRST_RETRY, LAST_RETRY = 0.5, 5.0  # s
SHOAL, AIRSIM = "Shoal", "AirSim"


class AirSimPicture(NamedTuple):
    """The result of an exposure: a picture (RGBA), and the state of its camera, in AirSim's north, east, down."""

    image: Image
    optics: CameraModel
    pose: Floats
    mount: Floats
    stamp: float
    motion: Kinematics | None


class AirSim(ImageSaverTask):
    """Shares frames that AirSim, Colosseum or Cosys-AirSim renders.

    They are those of one camera, or fisheye pictures from five or six views of 90°.

    With `Pose From = Shoal`, the vehicle is put where it really is before each exposure (SimulatedState, or without it
    EstimatedState), so AirSim is a renderer; on a virtual clock, time stands still while it works. With `Pose From =
    AirSim`, it moves by itself, and `Publish Truth` makes SimulatedState of its motion; the mount of the camera is
    measured from frame to frame, exactly when the vehicle is at rest. A server that is absent, hangs,
    or answers what cannot be used is named in the entity's state and asked again, at least every 5 s.
    """

    reads: ClassVar[Mapping[str, Mapping[str, SharedOption]]] = SECTIONS
    transient: ClassVar[tuple[str, ...]] = (*ImageSaverTask.transient, "_client", "_panorama", "_camera")

    host: str = param("127.0.0.1", "", "Name or address of the computer that AirSim runs on.", editable=False)
    port: int = param(41451, "1", "Its TCP port: ApiServerPort.", minimum=1, maximum=65535, editable=False)
    timeout: float = param(2.0, "s", "Time for an answer.", minimum=0.01, maximum=60, editable=False)
    vehicle_name: str = param("", "", "Vehicle in AirSim's settings; empty for the first one.", editable=False)
    cameras: list[str] = param(
        ["fisheye_down", "fisheye_front", "fisheye_right", "fisheye_back", "fisheye_left"],
        "",
        "Cameras in AirSim's settings: one, or the views down, front, right, back, left and perhaps up.",
        editable=False,
    )
    settings_file: str = param(
        "",
        "",
        "File settings.json, for camera values that AirSim does not provide; empty to request it from AirSim.",
        editable=False,
    )
    compress: bool = param(False, "", "Let AirSim send PNGs, which are smaller and slower.", editable=False)
    pose_from: str = param(SHOAL, "", "Source of the vehicle's motion.", choices=(SHOAL, AIRSIM), editable=False)
    publish_truth: bool = param(False, "", "Publish AirSim's motion as SimulatedState.", editable=False)
    origin: list[float] = param(
        [0.0, 0.0, 0.0], "m", "Position of the origin of [World] in AirSim: north, east and down.", size=3
    )
    frame_rate: float = param(5.0, "Hz", "Images per second.", minimum=0.01, maximum=1000, visibility="user")
    size: int = param(1024, "px", "Width and height of a fisheye image.", minimum=1, maximum=4096)
    field_of_view: float = param(180.0, "°", "Angle between opposite points of a fisheye image's rim.")
    lens: str = param("equidistant", "", "Kind of lens.", choices=tuple(LENS_PRESETS))
    interpolation: str = param("nearest", "", "Interpolation between the pixels of a view.", choices=INTERPOLATIONS)
    latency: float = param(0.05, "s", "Time from exposure to delivery on a virtual clock.", minimum=0, maximum=60)

    def configure(self) -> None:
        super().configure()
        world_of(self)
        if len(self.cameras) not in (1, 5, 6):
            raise ParameterError("Cameras", f"{len(self.cameras)} instead of one, five or six")
        if self.publish_truth and self.pose_from == SHOAL:
            raise ParameterError("Publish Truth", f"needs Pose From = {AIRSIM}")
        self._settings_text = self._read_settings()
        self._panorama: CubeMapAssembler | None = None
        if len(self.cameras) > 1:
            fov = math.radians(self.field_of_view)
            try:
                optics = FisheyeModel.from_lens(preset_lens(self.lens, fov), self.size)
                self._panorama = CubeMapAssembler(optics, len(self.cameras), self.interpolation)
            except ValueError as error:
                raise ParameterError("Field of View", str(error)) from None
            if warning := uncovered_warning(fov, len(self.cameras)):
                self.after(0.0, self.log.warning, warning)

    def _read_settings(self) -> str:
        """The text of settings.json, empty without the file. Raises ParameterError."""
        if not self.settings_file:
            return ""
        text = self.settings_file
        try:
            if not text.startswith(INLINE):
                text = self.resolve_parameter_path(text).read_text(encoding="utf-8-sig")
            named = parse_airsim_settings(text, self.vehicle_name)
        except (OSError, ValueError) as error:
            raise ParameterError(
                "Settings File", f"{self.settings_file[:80]}: {getattr(error, 'strerror', None) or error}"
            ) from None
        if missing := [name for name in self.cameras if name not in named]:
            raise ParameterError(
                "Settings File",
                f"{self.settings_file[:80]} has no camera {missing[0]}; there are {', '.join(named) or 'none'}",
            )
        text = json.dumps(json.loads(text))
        if NO_VALUE.isdisjoint(text):  # so that a log or a snapshot needs no other file
            self.settings_file = text
            self.vehicle.profile.override(f"{self.name}:Settings File={text}")
        return text

    def start(self) -> None:
        super().start()
        origin = world_of(self).origin
        self._truth, self._began = TrueState(origin), self.now
        self.pose_history: PoseHistory = PoseHistory(origin)
        self.taken: int = 0
        self.dropped: int = 0
        self.failed: int = 0
        self._trouble = Trouble()
        self._connect()
        self.set_entity_state(State.BOOT, f"connecting to {self._client.exchange.name}")

    def after_restore(self) -> None:
        super().after_restore()
        self._connect()

    @property
    def model_and_mount(self) -> tuple[CameraModel, Pose] | None:
        return self._camera

    def _connect(self) -> None:
        self._camera: tuple[CameraModel, Pose] | None = None
        turns = self._panorama.face_rotations if self._panorama else np.eye(3)[None]
        self._client = AirSimClient(
            self.host,
            self.port,
            self.timeout,
            self.vehicle_name,
            self.cameras,
            turns,
            compress=self.compress,
            settings=self._settings_text,
        )
        self._busy, self._backoff, self._next = False, Backoff(FIRST_RETRY, LAST_RETRY), self.now

    def stop(self) -> None:
        self._client.exchange.close()

    @consume
    def record_estimated_pose(self, state: imc.EstimatedState) -> None:
        self.pose_history.add(state)

    @consume
    def update_truth(self, truth: imc.SimulatedState) -> None:
        self._truth.update(truth)

    @periodic("frame_rate")
    def expose(self) -> None:
        if self._busy and not self.vehicle.has_virtual_time:
            self.dropped += 1
            return
        if self.now < self._next:
            return
        truth, pose = self._truth.pose_at(self.now, OLDEST), None
        estimated = self.pose_history.pose_at(self.now, OLDEST)
        if self.pose_from == SHOAL:
            if truth is None and self._truth.fault:
                self.set_entity_state(State.FAULT, self._truth.fault)
                return
            pose = estimated if truth is None else Pose(truth.north, truth.east, truth.down, *truth.angles)
            if pose is None:
                if self.age(max(self._stated, self._began)) > OLDEST:
                    self.set_entity_state(State.FAULT, f"no SimulatedState or EstimatedState of the last {OLDEST:g} s")
                elif self._stated == -math.inf:
                    self.set_entity_state(State.BOOT, "waiting for SimulatedState")
                return
            x, y, z = self.origin
            pose = pose._replace(x=pose.x + x, y=pose.y + y, z=pose.z + z)
        self._busy = True
        deliver = partial(self._deliver, self.now, estimated, pose is None or truth is not None)
        self.offload(_shoot, self._client, self._panorama, pose, then=deliver, latency=self.latency)

    @property
    def _stated(self) -> float:
        """Time at which the newest state was true (s since 1970); -infinity without any."""
        latest = self.pose_history.latest_state
        return max(self._truth.latest_time, -math.inf if latest is None else latest.timestamp)

    def _deliver(self, time: float, estimated: Pose | None, is_true: bool, made: AirSimPicture | str) -> None:
        self._busy = False
        if isinstance(made, str):
            self._fail(made)
            return
        self._next = self.now
        self._backoff.reset()
        while self._client.notes:
            self.log.warning(self._client.notes.pop(0))
        if self._trouble.end() or not self.taken:
            self.log.info(f"{self._client.exchange.name} answers")
        self.report_entity_state(f"{self.taken + 1} frames, {self.dropped} dropped, {self.failed} failed")
        pose = made.pose.copy()
        pose[:3, 3] -= self.origin
        if estimated is None:  # after a stall, the next state has come meanwhile
            estimated = self.pose_history.pose_at(time, OLDEST)
        info = {"airsim_time": made.stamp}
        self.share(Frame(time, self.entity.label, self.taken, made.image, info, made.optics, made.mount, pose))
        estimate = None if estimated is None else estimated.transform @ made.mount
        self._camera = made.optics, Pose.from_transform(made.mount @ np.linalg.inv(optical_to_body_transform(Pose())))
        file = (
            self.save(time, made.image, self.picture_location_from_state(self.pose_history.latest_state))
            if self.should_save()
            else ""
        )
        self.publish(camera_frame_message(time, self.taken, made.optics, pose, estimate, file, is_true=is_true))
        self.taken += 1
        if self.publish_truth and made.motion is not None:
            self.publish(self._simulated(made.motion).replace(timestamp=time), keep_time=True)

    def _fail(self, why: str) -> None:
        self.failed += 1
        self._next = self.now + self._backoff.fail()
        named = f"{self._client.exchange.name}: {why}"
        self._trouble.report(why, self.log.error, named)
        self.set_entity_state(State.ERROR, f"{named} ({self.failed} failed)")

    def _simulated(self, motion: Kinematics) -> imc.SimulatedState:
        """State relative to the start of the vehicle; AirSim's air does not move."""
        home, body = self._client.home, Pose.from_transform(pose_transform(motion.position, motion.orientation))
        speed, rates = motion.linear_velocity, motion.angular_velocity
        velocity = to_body(body.rotation, (speed.x_val, speed.y_val, speed.z_val))
        turn = rates.x_val, rates.y_val, rates.z_val
        start = (0.0, 0.0, 0.0)
        if home is not None:
            start = math.radians(home.latitude), math.radians(home.longitude), home.altitude
        angles, still = (body.phi, body.theta, body.psi), (0.0, 0.0, 0.0)
        return simulated_state(body.position, velocity, angles, turn, still, start)


def _shoot(client: AirSimClient, panorama: CubeMapAssembler | None, pose: Pose | None) -> AirSimPicture | str:
    """A picture, or why there is none."""
    try:
        shot = client.capture(None if pose is None else (pose.position, (pose.phi, pose.theta, pose.psi)))
        body = _body(shot) if pose is None else pose.transform
    except AirSimError as error:
        return str(error)
    except OSError as error:
        return error.strerror or str(error)
    if panorama is not None:
        image, optics = panorama.assemble_camera_image(shot.images), panorama.optics
    else:
        height, width, _ = shot.images[0].shape
        image = np.full((height, width, 4), 255, np.uint8)
        image[..., :3] = shot.images[0]
        optics = PinholeModel(width, height, *shot.focal, 0.5 * width, 0.5 * height)
    return AirSimPicture(image, optics, shot.pose, mount_from_poses(shot.pose, body), shot.stamp, shot.motion)


def _body(shot: AirSimCapture) -> Floats:
    assert shot.motion is not None
    return pose_transform(shot.motion.position, shot.motion.orientation)
