"""What cameras have in common that may be anywhere on the vehicle, with a calibration file."""

from runtime import ParameterError, param
from tasks.surroundings import mount_of
from tasks.vision.keeping import PictureKeeper
from world import Pose
from world.optics import CalibrationError, CameraModel, read_camera


class MountedCamera(PictureKeeper):
    """A camera with a mount, and the model of a file if there is one."""

    calibration: str = param(
        "",
        "",
        "A calibration file, of Kalibr, OpenCV, ROS, EuRoC or WoodScape, or the cameras.yaml of a log; with #NAME for "
        "one of several cameras; a relative path counts from the profile, or the working folder.",
        editable=False,
    )
    mount_position: list[float] = param(
        [0.0, 0.0, 0.0], "m", "Where the camera is in the vehicle: forward, right, down.", size=3
    )
    mount_orientation: list[float] = param(
        [0.0, -90.0, 0.0],
        "°",
        "Roll, pitch and yaw in the vehicle of a camera that looks ahead; -90 looks down.",
        size=3,
    )

    @property
    def mount(self) -> Pose:
        """Where the camera is in the vehicle."""
        return mount_of(self.mount_position, self.mount_orientation)

    def calibrated(self) -> CameraModel | None:
        """The model of the calibration file; None if none is given. Raises ParameterError."""
        try:
            return self.read(self.calibration) if self.calibration else None
        except (CalibrationError, OSError) as error:
            raise ParameterError("Calibration", str(error)) from None

    def read(self, calibration: str) -> CameraModel:
        """The model of a file, or of one of several cameras in it (FILE#NAME). Raises CalibrationError, OSError."""
        file, _, name = calibration.partition("#")
        return read_camera(self.path_of(file), name)
