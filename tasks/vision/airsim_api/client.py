"""Asks AirSim, Colosseum or Cosys-AirSim for pictures and truth; blocks, so it belongs into a worker."""

import math
from typing import Any, NamedTuple

import numpy as np

from runtime.devices import TcpRequester
from tasks.vision.airsim_api.camera_mount_estimation import MountEstimator, rotation_angle_between
from tasks.vision.airsim_api.rpc_messages import (
    COSYS,
    AirSimError,
    CameraInfo,
    GeoPoint,
    Image,
    ImageResponse,
    Kinematics,
    MessageEnd,
    airsim_pose,
    decode_answer,
    decode_pixels,
    encode_request,
    image_request,
    optical_pose,
)
from world.optics import AirSimCamera, CalibrationError, Floats, parse_airsim_settings

ALIGNED = math.radians(1.0)  # by which a camera may look elsewhere than its face
FACE = 2e-5  # by which the focal length of a face may be off half of its side
DIFFERENT = math.radians(0.01)  # between the field of view of pictures and that in settings.json
TOGETHER = 0.1  # s between the pictures of one answer


class AirSimCapture(NamedTuple):
    """Pictures (RGB) of one instant. `stamp` is AirSim's time (s), `pose` (4, 4) leads from the optical frame of the
    first camera to AirSim's north, east, down; `focal` are its focal lengths along rows and columns (px)."""

    images: list[Image]
    stamp: float
    pose: Floats
    focal: tuple[float, float]
    motion: Kinematics | None = None


class RpcClient:
    """Calls methods of a server, one at a time. Raises OSError, AirSimError."""

    def __init__(self, host: str, port: int, timeout: float):
        self.exchange: TcpRequester = TcpRequester(host, port, timeout)
        self._count = 0

    def call(self, method: str, kind: Any, *parameters: Any) -> Any:
        """The result, as a value of `kind`."""
        self._count += 1
        try:
            data = self.exchange.request(encode_request(self._count, method, *parameters), MessageEnd().is_complete)
            return decode_answer(data, self._count, kind)
        except (ValueError, AirSimError) as error:
            raise AirSimError(f"{method}: {error}") from None


class AirSimClient(RpcClient):
    """`cameras` are asked for in one call. With more than one, they are 90° faces, which `turns` (N, 3, 3) take to the
    optical frame of the first one, and are checked."""

    def __init__(
        self,
        host: str,
        port: int,
        timeout: float,
        vehicle: str,
        cameras: list[str],
        turns: Floats,
        *,
        compress: bool,
        settings: str = "",
    ):
        """`settings` is the text of settings.json; without it AirSim is asked for its own."""
        super().__init__(host, port, timeout)
        self.home: GeoPoint | None = None
        self.notes: list[str] = []  # differences between settings.json and the pictures
        self._settings = settings
        self._vehicle, self._cameras, self._turns, self._compress = vehicle, cameras, turns, compress
        self._cosys = False
        self._mount = MountEstimator()
        self._scales = (1.0, 1.0)

    def capture(self, place: tuple[Any, Any] | None) -> AirSimCapture:
        """Move the vehicle to `place` (north, east, down; roll, pitch, yaw), if it is given, and take the pictures.

        Without a place, the motion of the vehicle at that instant is in the result, as far as `MountEstimator` has
        it. Raises OSError, AirSimError.
        """
        try:
            if not self.exchange.is_open:
                self._begin()
            if place is not None:
                self.call("simSetVehiclePose", type(None), airsim_pose(*place), True, self._vehicle)
            before = None if place is not None else self._motion()
            asked = [image_request(name, compress=self._compress, cosys=self._cosys) for name in self._cameras]
            answers = self.call("simGetImages", list[ImageResponse], asked, self._vehicle, *self._outside)
            shot = self._checked(answers)
            if before is None:
                return shot
            return shot._replace(motion=self._mount.vehicle_motion_at_capture(before, shot.pose, self._motion()))
        except AirSimError:
            self.exchange.disconnect()
            raise

    def _motion(self) -> Kinematics:
        found = self.call("simGetGroundTruthKinematics", Kinematics, self._vehicle)
        found.validate()
        return found

    @property
    def _outside(self) -> tuple[bool, ...]:
        """AirSim's last parameter is whether a camera belongs to no vehicle."""
        return () if self._cosys else (False,)

    def _begin(self) -> None:
        self._mount = MountEstimator()
        self._cosys = self.call("getServerVersion", int) >= COSYS
        home = self.call("getHomeGeoPoint", GeoPoint, self._vehicle)
        home.validate()
        self.home = home
        cameras = self._listed_cameras()
        scales = [self._picture_scales(name, cameras.get(name)) for name in self._cameras]
        for name, (across, down) in zip(self._cameras, scales, strict=True):
            if len(scales) > 1 and max(abs(across - 1.0), abs(down - 1.0)) > FACE:
                raise AirSimError(
                    f"{name}: its pictures have {math.degrees(2.0 * math.atan(1.0 / across)):.6g} x "
                    f"{math.degrees(2.0 * math.atan(1.0 / down)):.6g}°, not 90: see FOV_Degrees of ImageType 0, and "
                    "Width and Height, in settings.json"
                )
        self._scales = scales[0]

    def _picture_scales(self, name: str, entry: AirSimCamera | None) -> tuple[float, float]:
        """Focal lengths in halves of width and height, of AirSim's projection, or else of settings.json."""
        info = self.call("simGetCameraInfo", CameraInfo, name, self._vehicle, *self._outside)
        scales = None if info.proj_mat is None else info.proj_mat.scales()
        expected = None if entry is None else (2.0 * entry.model.fx / entry.width, 2.0 * entry.model.fy / entry.height)
        if scales is None and expected is None:
            raise AirSimError(f"{name}: neither proj_mat of simGetCameraInfo nor settings.json describes its view")
        if scales is None or expected is None:
            return scales or expected or (1.0, 1.0)
        found, stated = (math.degrees(2.0 * math.atan(1.0 / each[0])) for each in (scales, expected))
        if abs(found - stated) > math.degrees(DIFFERENT):
            self.notes.append(f"{name}: its pictures have {found:.6g}°, settings.json has {stated:.6g}°")
        return scales

    def _listed_cameras(self) -> dict[str, AirSimCamera]:
        """The cameras of settings.json; none from a server that does not send it."""
        text = self._settings
        if not text:
            try:
                text = self.call("getSettingsString", str)
            except AirSimError:
                return {}
        try:
            return parse_airsim_settings(text, self._vehicle) if text else {}
        except CalibrationError as error:
            self.notes.append(f"settings.json: {error}")
            return {}

    def _checked(self, answers: list[ImageResponse]) -> AirSimCapture:
        if len(answers) != len(self._cameras):
            raise AirSimError(f"{len(answers)} pictures instead of {len(self._cameras)}")
        images = [decode_pixels(name, answer) for name, answer in zip(self._cameras, answers, strict=True)]
        stamps = [answer.time_stamp for answer in answers]
        if max(stamps) - min(stamps) > TOGETHER * 1e9:
            raise AirSimError(f"pictures {(max(stamps) - min(stamps)) / 1e9:.3g} s apart")
        poses = [optical_pose(answer) for answer in answers]
        if len(images) > 1:
            self._check_faces(images, poses)
        height, width, _ = images[0].shape
        focal = 0.5 * width * self._scales[0], 0.5 * height * self._scales[1]
        return AirSimCapture(images, stamps[0] / 1e9, poses[0], focal)

    def _check_faces(self, images: list[Image], poses: list[Floats]) -> None:
        sizes = {image.shape for image in images}
        if len(sizes) > 1 or images[0].shape[0] != images[0].shape[1]:
            found = ", ".join(
                f"{name} {i.shape[1]} x {i.shape[0]}" for name, i in zip(self._cameras, images, strict=True)
            )
            raise AirSimError(f"the views are not squares of one size: {found} px")
        for name, pose, turn in zip(self._cameras, poses, self._turns, strict=True):
            off = rotation_angle_between(poses[0][:3, :3] @ turn, pose[:3, :3])
            if off > ALIGNED:
                raise AirSimError(f"{name} looks {math.degrees(off):.1f}° from where it should: see its Pitch and Yaw")


def mount_from_poses(pose: Floats, vehicle: Floats) -> Floats:
    """(4, 4) from the frame of a camera to the body of the vehicle, from both poses."""
    return np.linalg.inv(vehicle) @ pose
