"""Models of sensors: noise and geometry."""

from world.sensors import mug_original
from world.sensors.imu import (
    STANDARD_GRAVITY,
    NoiseDensity,
    NoisyTriad,
    StandardNormals,
    specific_force,
    vins_parameters,
)
from world.sensors.mug_detection import UNIFORM_ERROR, CameraPose, Offset, detect, detect_originally, gsd_sigma
from world.sensors.sonar import Beam
from world.sensors.strapdown import BodyMotion, InertialSample, InertialSampler

__all__ = [
    "STANDARD_GRAVITY",
    "UNIFORM_ERROR",
    "Beam",
    "BodyMotion",
    "CameraPose",
    "InertialSample",
    "InertialSampler",
    "NoiseDensity",
    "NoisyTriad",
    "Offset",
    "StandardNormals",
    "detect",
    "detect_originally",
    "gsd_sigma",
    "mug_original",
    "specific_force",
    "vins_parameters",
]
