"""Models of sensors: noise and geometry."""

from world.sensors import mug_reference
from world.sensors.beam_echo import Echo, janus, listen, to_bottom, velocity_of
from world.sensors.drift import Drift
from world.sensors.imu_grade import DRAWS, PARTS, Device, Part, TriadGrade
from world.sensors.imu_noise import (
    STANDARD_GRAVITY,
    NoiseDensity,
    NoisyTriad,
    StandardNormals,
    specific_force,
    vins_parameters,
)
from world.sensors.mug_detection import (
    ACCURACY,
    UNIFORM_ERROR,
    CameraPose,
    Offset,
    detect,
    detect_originally,
    gsd_sigma,
    locate,
    see_pixel,
    to_camera,
)
from world.sensors.sonar_beam import Beam
from world.sensors.strapdown import BodyMotion, InertialSample, InertialSampler

__all__ = [
    "ACCURACY",
    "DRAWS",
    "PARTS",
    "STANDARD_GRAVITY",
    "UNIFORM_ERROR",
    "Beam",
    "BodyMotion",
    "CameraPose",
    "Device",
    "Drift",
    "Echo",
    "InertialSample",
    "InertialSampler",
    "NoiseDensity",
    "NoisyTriad",
    "Offset",
    "Part",
    "StandardNormals",
    "TriadGrade",
    "detect",
    "detect_originally",
    "gsd_sigma",
    "janus",
    "listen",
    "locate",
    "mug_reference",
    "see_pixel",
    "specific_force",
    "to_bottom",
    "to_camera",
    "velocity_of",
    "vins_parameters",
]
