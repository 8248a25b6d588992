"""Camera models."""

from world.optics.brown_conrady import PinholeCamera
from world.optics.calibration_files import camera_text, parse_camera, read_camera
from world.optics.camera_model import CalibrationError, CameraModel, Floats
from world.optics.double_sphere import DoubleSphereCamera
from world.optics.fisheye import FisheyeCamera, kannala_brandt
from world.optics.lens import PRESETS, Lens, preset_lens
from world.optics.pinhole import Pinhole
from world.optics.underwater_housing import Dome, FlatPort, HousedCamera, housed

__all__ = [
    "PRESETS",
    "CalibrationError",
    "CameraModel",
    "Dome",
    "DoubleSphereCamera",
    "FisheyeCamera",
    "FlatPort",
    "Floats",
    "HousedCamera",
    "Lens",
    "Pinhole",
    "PinholeCamera",
    "camera_text",
    "housed",
    "kannala_brandt",
    "parse_camera",
    "preset_lens",
    "read_camera",
]
