"""Navigation: Kalman filters, gates and checks that find faulty sensors, and the estimator of an underwater vehicle."""

from autonomy.navigation.aerial_height import AerialHeight
from autonomy.navigation.asv_filter import STREAM_EAST, STREAM_NORTH, ASVFilter
from autonomy.navigation.attitude_range import LARGEST_PITCH, LARGEST_ROLL, AttitudeRange
from autonomy.navigation.barometric_height import BarometricHeight, pressure_altitude
from autonomy.navigation.cross_checks import AttitudeCheck, DepthCheck
from autonomy.navigation.depth_filter import DepthFilter
from autonomy.navigation.fault_detection import (
    Disagreement,
    GateDecision,
    JumpGate,
    NoiseMonitor,
    StuckDetector,
    missing_reason,
)
from autonomy.navigation.gnss_drift import FixDriftDetector
from autonomy.navigation.gnss_fix_statistics import horizontal_variance, mean_fix, offset_from
from autonomy.navigation.gnss_position_correction import (
    AGREEMENT,
    CONTRADICTION,
    CONTRADICTIONS,
    PositionEstimate,
    fix_variance,
)
from autonomy.navigation.gnss_velocity_check import GnssVelocityCheck, ground_velocity, reported_velocity
from autonomy.navigation.hard_iron import HardIron, HardIronError, HardIronFit
from autonomy.navigation.horizontal_filter import EAST, NORTH, HorizontalFilter
from autonomy.navigation.impossible_values import ImpossibleValues
from autonomy.navigation.inertial_filter import InertialFilter
from autonomy.navigation.sample_mean import SampleMean
from autonomy.navigation.sensor_fault_isolation import SensorChecks
from autonomy.navigation.sensor_inputs import SensorInputs
from autonomy.navigation.state_messages import estimated_state, initial_state, navigation_data, navigation_uncertainty
from autonomy.navigation.underwater_estimator import UnderwaterEstimator
from autonomy.navigation.underwater_settings import UnderwaterSettings
from autonomy.navigation.validation_gates import (
    DEEPEST,
    FAULT_HOLD,
    GPS_JUMP,
    LARGEST_RATE,
    FixGate,
    Reason,
    VelocityGate,
    assume_height,
    has_plausible_position,
)
from autonomy.navigation.vertical_speed_estimator import VerticalSpeedEstimator

__all__ = [
    "AGREEMENT",
    "CONTRADICTION",
    "CONTRADICTIONS",
    "DEEPEST",
    "EAST",
    "FAULT_HOLD",
    "GPS_JUMP",
    "LARGEST_PITCH",
    "LARGEST_RATE",
    "LARGEST_ROLL",
    "NORTH",
    "STREAM_EAST",
    "STREAM_NORTH",
    "ASVFilter",
    "AerialHeight",
    "AttitudeCheck",
    "AttitudeRange",
    "BarometricHeight",
    "DepthCheck",
    "DepthFilter",
    "Disagreement",
    "FixDriftDetector",
    "FixGate",
    "GateDecision",
    "GnssVelocityCheck",
    "HardIron",
    "HardIronError",
    "HardIronFit",
    "HorizontalFilter",
    "ImpossibleValues",
    "InertialFilter",
    "JumpGate",
    "NoiseMonitor",
    "PositionEstimate",
    "Reason",
    "SampleMean",
    "SensorChecks",
    "SensorInputs",
    "StuckDetector",
    "UnderwaterEstimator",
    "UnderwaterSettings",
    "VelocityGate",
    "VerticalSpeedEstimator",
    "assume_height",
    "estimated_state",
    "fix_variance",
    "ground_velocity",
    "has_plausible_position",
    "horizontal_variance",
    "initial_state",
    "mean_fix",
    "missing_reason",
    "navigation_data",
    "navigation_uncertainty",
    "offset_from",
    "pressure_altitude",
    "reported_velocity",
]
