"""Camera models."""

from world.optics.airsim_settings import AirSimCamera, airsim_cameras, parse_airsim_settings
from world.optics.arctangent_lens import ArctangentModel
from world.optics.brown_conrady import PinholeModel, fit_radtan
from world.optics.calibration_files import calibration_file_to_json, parse_calibration, read_calibration
from world.optics.camera_model import CalibrationError, CameraModel, Floats
from world.optics.double_sphere import DoubleSphereModel
from world.optics.fisheye import FisheyeModel, kannala_brandt_lens
from world.optics.fov_pinhole_camera import FieldOfViewCamera
from world.optics.polynomial_lens import LENS_PRESETS, Lens, preset_lens
from world.optics.rational_lens import RationalModel
from world.optics.rolling_shutter import project_by_row, row_time
from world.optics.underwater_housing import DomePort, FlatPort, HousedModel, put_behind_port
from world.optics.unit_sphere import ExtendedUnifiedModel, OmnidirectionalModel

__all__ = [
    "LENS_PRESETS",
    "AirSimCamera",
    "ArctangentModel",
    "CalibrationError",
    "CameraModel",
    "DomePort",
    "DoubleSphereModel",
    "ExtendedUnifiedModel",
    "FieldOfViewCamera",
    "FisheyeModel",
    "FlatPort",
    "Floats",
    "HousedModel",
    "Lens",
    "OmnidirectionalModel",
    "PinholeModel",
    "RationalModel",
    "airsim_cameras",
    "calibration_file_to_json",
    "fit_radtan",
    "kannala_brandt_lens",
    "parse_airsim_settings",
    "parse_calibration",
    "preset_lens",
    "project_by_row",
    "put_behind_port",
    "read_calibration",
    "row_time",
]
