"""Control laws: what a vehicle's state and reference make of its actuators."""

from autonomy.control.attitude_controller import AttitudeController, AttitudeGains, AttitudeReference
from autonomy.control.blind_descent import DESCENT as BLIND_DESCENT
from autonomy.control.blind_descent import RECOVERY, BlindDescent
from autonomy.control.bottom_depth_filter import BottomEstimator
from autonomy.control.depth_controller import DepthController, DepthGains
from autonomy.control.differential_thrust import allocate_thrust, forces_to_actuations
from autonomy.control.echo_classifier import EchoClass, classify_echo
from autonomy.control.enabled_loops import EnabledLoops
from autonomy.control.fin_allocation import Fins, allocate_fins, fin_torques
from autonomy.control.flight_phase import FlightPhase
from autonomy.control.heading_controller import HORIZONTAL, HeadingController
from autonomy.control.immersion_detector import ImmersionDetector
from autonomy.control.landing_reasons import LOW_BATTERY, LandingReasons
from autonomy.control.measured_depth import DepthCondition, MeasuredDepth
from autonomy.control.message_delay import MessageDelay
from autonomy.control.multirotor_tilt_and_thrust import GRAVITY, rotor_actuation, tilt_and_thrust
from autonomy.control.multirotor_velocity_controller import MultirotorCommand, MultirotorController, MultirotorGains
from autonomy.control.pid import PID, PIDGains
from autonomy.control.power_dips import PowerDips
from autonomy.control.powered_ascent import AscentMonitor, ascent_fins, blind_ascent_fins
from autonomy.control.remote_actions_reader import (
    AXES,
    BUTTONS,
    RemoteActionsReader,
    format_actions_request,
    format_remote_actions,
)
from autonomy.control.speed_controller import SpeedController
from autonomy.control.touchdown_detector import TouchdownDetector
from autonomy.control.underwater_speed_controller import STANDSTILL, ThrusterController, ThrusterGains

__all__ = [
    "AXES",
    "BLIND_DESCENT",
    "BUTTONS",
    "GRAVITY",
    "HORIZONTAL",
    "LOW_BATTERY",
    "PID",
    "RECOVERY",
    "STANDSTILL",
    "AscentMonitor",
    "AttitudeController",
    "AttitudeGains",
    "AttitudeReference",
    "BlindDescent",
    "BottomEstimator",
    "DepthCondition",
    "DepthController",
    "DepthGains",
    "EchoClass",
    "EnabledLoops",
    "Fins",
    "FlightPhase",
    "HeadingController",
    "ImmersionDetector",
    "LandingReasons",
    "MeasuredDepth",
    "MessageDelay",
    "MultirotorCommand",
    "MultirotorController",
    "MultirotorGains",
    "PIDGains",
    "PowerDips",
    "RemoteActionsReader",
    "SpeedController",
    "ThrusterController",
    "ThrusterGains",
    "TouchdownDetector",
    "allocate_fins",
    "allocate_thrust",
    "ascent_fins",
    "blind_ascent_fins",
    "classify_echo",
    "fin_torques",
    "forces_to_actuations",
    "format_actions_request",
    "format_remote_actions",
    "rotor_actuation",
    "tilt_and_thrust",
]
