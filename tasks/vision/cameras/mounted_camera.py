"""Common parts of cameras with a position on the vehicle and a calibration file."""

from runtime import ParameterError, param
from support.pose import Pose
from tasks.simulated_world import mount_pose, position_param
from tasks.vision.cameras.image_saver import ImageSaverTask
from world.optics import CalibrationError, CameraModel, calibration_file_to_json, parse_calibration

INLINE = "{"  # begins a calibration that is no file
NO_VALUE = frozenset(";|#\n")  # what values of a profile cannot have


class MountedCameraTask(ImageSaverTask):
    """A camera with a mount, and the model of a file if there is one."""

    calibration: str = param(
        "",
        "",
        "A calibration file, of Kalibr, OpenCV, ROS, EuRoC, WoodScape, VINS-Fusion, ORB-SLAM3, DepthAI, mrcal or "
        "AirSim, or the cameras.yaml of a log. A relative path counts from the profile, or, if there is no such file, "
        "from the working folder. A log has its content.",
        editable=False,
    )
    calibration_camera: str = param(
        "", "", "Camera of that file, if it has several: cam1, or an entity label.", editable=False
    )
    mount_position: list[float] = position_param(
        "Position of the camera in the vehicle: forward, right, down.", [0.0, 0.0, 0.0]
    )
    mount_orientation: list[float] = param(
        [0.0, -90.0, 0.0],
        "°",
        "Roll, pitch and yaw in the vehicle of a camera that looks ahead; -90 looks down.",
        size=3,
    )

    @property
    def mount(self) -> Pose:
        """The pose of the camera in the vehicle."""
        return mount_pose(self.mount_position, self.mount_orientation)

    def read_calibration(self) -> CameraModel | None:
        """The model of the calibration file; None if none is given. Raises ParameterError.

        The content of the file becomes part of the configuration, so that a log or a snapshot needs no other file.
        """
        if not self.calibration:
            return None
        try:
            text = self.calibration
            if not text.startswith(INLINE):
                text = calibration_file_to_json(self.resolve_parameter_path(text), self.calibration_camera)
                if NO_VALUE.isdisjoint(text):
                    self.calibration = text
                    self.vehicle.profile.override(f"{self.name}:Calibration={text}")
            return parse_calibration(text)
        except CalibrationError as error:
            raise ParameterError("Calibration", str(error)) from None
        except OSError as error:
            raise ParameterError("Calibration", f"{error.filename}: {error.strerror or error}") from None
