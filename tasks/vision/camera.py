"""Simulates a camera with any lens, anywhere on the vehicle."""

import math
from collections.abc import Iterator

import numpy as np

from runtime import ConfigWarning, ParameterError, param
from tasks.vision.cameras.mounted_camera import MountedCameraTask
from tasks.vision.cameras.rendered_camera import RenderedCameraTask
from world.optics import CalibrationError, CameraModel, DomePort, FlatPort, PinholeModel, put_behind_port

REPLACED = "width", "height", "field_of_view", "principal_point", "distortion"  # by a calibration
GRID = 9  # sampled columns and rows that show whether an image is empty


class Camera(MountedCameraTask, RenderedCameraTask):
    """Shares frames of the seabed under a diving vehicle, or of the sea under a flying one, and of gliders.

    By default it looks down, the top of its image to the bow. Its model is a pinhole with the distortion of Brown and
    Conrady, or the one of a calibration file, which replaces all options of the pinhole. Cameras with one frame rate
    expose at the same instants: two of them are a stereo camera. Poses, frames and events are like those of
    Vision.FisheyeCamera.
    """

    width: int = param(640, "px", "Width of the image.", minimum=1, maximum=8192)
    height: int = param(480, "px", "Height of the image.", minimum=1, maximum=8192)
    field_of_view: float = param(
        80.0, "°", "Angle between the left and the right border of an image without distortion.", minimum=1, maximum=170
    )
    principal_point: list[float] = param(
        [], "px", "Principal point of the image, from its left upper corner; by default its middle.", size=(0, 2)
    )
    distortion: list[float] = param([], "1", "k1, k2, p1, p2 and k3, as OpenCV counts them.", size=(0, 5))
    face_size: int = param(
        0, "px", "Width of the views of 90° that make up an image; 0 is as fine as the image.", minimum=0, maximum=8192
    )

    housing: str = param(
        "None",
        "",
        "The window between air and water; nothing in a scene in air.",
        choices=("None", "Flat Port", "Dome"),
    )
    port_distance: float = param(
        0.03, "m", "From the camera's center to the pane of a flat port.", minimum=0, maximum=10
    )
    port_thickness: float = param(0.01, "m", "Of the glass of a flat port or a dome.", minimum=0, maximum=1)
    dome_radius: float = param(0.08, "m", "Inner radius of a dome.", minimum=0.001, maximum=10)
    dome_offset: float = param(
        0.0, "m", "How far the camera's center is before that of a dome.", minimum=-10, maximum=10
    )
    subject_distance: float = param(
        3.0, "m", "Distance of exact pictures through a port; nearer and farther, a pixel or some off.", minimum=0.01
    )

    def configure(self) -> None:
        model = self._model()
        rows, columns = (np.linspace(0.0, size, GRID) for size in (model.height, model.width))
        seen = model.unproject(np.stack(np.meshgrid(columns, rows), axis=-1))[1]
        if not seen.any():
            raise ParameterError("Calibration" if self.calibration else "Principal Point", "nothing is in the image")
        if model.fold_angle is not None and not seen.all():
            text = f"the lens folds {math.degrees(model.fold_angle):.4g}° off its axis: the image is empty beyond"
            self.after(0.0, self.log.warning, text)  # later: at load, no task receives messages yet
        self._optics = self._housed(model)
        super().configure()

    def configuration_warnings(self) -> Iterator[ConfigWarning]:
        for parameter in self.parameters().values() if self.calibration else ():
            if parameter.attribute in REPLACED and getattr(self, parameter.attribute) != parameter.default:
                yield ConfigWarning(
                    parameter.name, f"{parameter.name} has no effect: the Calibration replaces it", "delete it"
                )
        if self.housing != "None" and self.scene != "Seabed":
            yield ConfigWarning("Housing", f"Housing has no effect: Scene = {self.scene} is in air")

    def face_width_and_count(self) -> tuple[int, int]:
        return self.face_size, 6

    def camera_model(self) -> CameraModel:
        return self._optics

    def _housed(self, camera: CameraModel) -> CameraModel:
        if self.scene != "Seabed":  # in air, a pane or a dome turns no ray
            return camera
        try:
            port = None
            if self.housing == "Flat Port":
                port = FlatPort(self.port_thickness, distance=self.port_distance)
            elif self.housing == "Dome":
                port = DomePort(self.port_thickness, radius=self.dome_radius, offset=self.dome_offset)
            return put_behind_port(camera, port, self.subject_distance)
        except CalibrationError as error:
            raise ParameterError("Housing", str(error)) from None

    def _model(self) -> CameraModel:
        if (calibrated := self.read_calibration()) is not None:
            return calibrated
        focal = self.width / 2 / math.tan(math.radians(self.field_of_view) / 2)
        if len(self.principal_point) == 1:
            raise ParameterError("Principal Point", "must be two numbers, or nothing")
        cx, cy = self.principal_point or (self.width / 2, self.height / 2)
        k1, k2, p1, p2, k3 = [*self.distortion, *[0.0] * 5][:5]
        try:
            return PinholeModel(self.width, self.height, focal, focal, cx, cy, k1, k2, p1, p2, k3)
        except CalibrationError as error:
            raise ParameterError("Distortion", str(error)) from None
