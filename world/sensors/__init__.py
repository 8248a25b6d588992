"""Models of sensors: noise and geometry."""

from world.sensors import original_mug_camera
from world.sensors.drift import Drift
from world.sensors.imu_grade import IMU_PARTS, TRIAD_DRAWS, ImuPart, TriadErrors, TriadGrade
from world.sensors.imu_noise import (
    STANDARD_GRAVITY,
    NoiseDensity,
    NoisyTriad,
    StandardNormals,
    specific_force,
    vins_parameters,
)
from world.sensors.inertial_sampler import BodyMotion, InertialSample, InertialSampler
from world.sensors.magnetometer import Magnetometer
from world.sensors.mug_detection_error_model import DetectionErrorModel
from world.sensors.mug_detection_geometry import (
    ACCURACY,
    UNIFORM_ERROR,
    AttitudeAndHeight,
    NorthEastOffset,
    detect_target,
    detection_at_pixel,
    ground_position_sigma,
    locate_like_original_camera,
    locate_target_on_plane,
    target_in_camera,
)
from world.sensors.range_and_doppler import (
    BeamEcho,
    distance_to_bottom,
    janus_directions,
    nearest_echo,
    velocity_from_beams,
)
from world.sensors.sonar_beam import SonarBeam

__all__ = [
    "ACCURACY",
    "IMU_PARTS",
    "STANDARD_GRAVITY",
    "TRIAD_DRAWS",
    "UNIFORM_ERROR",
    "AttitudeAndHeight",
    "BeamEcho",
    "BodyMotion",
    "DetectionErrorModel",
    "Drift",
    "ImuPart",
    "InertialSample",
    "InertialSampler",
    "Magnetometer",
    "NoiseDensity",
    "NoisyTriad",
    "NorthEastOffset",
    "SonarBeam",
    "StandardNormals",
    "TriadErrors",
    "TriadGrade",
    "detect_target",
    "detection_at_pixel",
    "distance_to_bottom",
    "ground_position_sigma",
    "janus_directions",
    "locate_like_original_camera",
    "locate_target_on_plane",
    "nearest_echo",
    "original_mug_camera",
    "specific_force",
    "target_in_camera",
    "velocity_from_beams",
    "vins_parameters",
]
