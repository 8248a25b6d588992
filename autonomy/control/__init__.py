"""Control laws: what a vehicle's state and reference make of its actuators."""

from autonomy.control.bottom_estimator import BottomEstimator
from autonomy.control.differential_thrust import allocate_thrust, motor_actuations
from autonomy.control.echo_classifier import EchoClass, classify_echo
from autonomy.control.enabled_loops import EnabledLoops
from autonomy.control.fin_allocation import Fins, allocate_fins, fin_torques
from autonomy.control.heading_controller import HORIZONTAL, HeadingController
from autonomy.control.multirotor_thrust import GRAVITY, tilt_and_thrust
from autonomy.control.operator_input import AXES, BUTTONS, OperatorInput, format_actions
from autonomy.control.pid import PID
from autonomy.control.speed_controller import SpeedController

__all__ = [
    "AXES",
    "BUTTONS",
    "GRAVITY",
    "HORIZONTAL",
    "PID",
    "BottomEstimator",
    "EchoClass",
    "EnabledLoops",
    "Fins",
    "HeadingController",
    "OperatorInput",
    "SpeedController",
    "allocate_fins",
    "allocate_thrust",
    "classify_echo",
    "fin_torques",
    "format_actions",
    "motor_actuations",
    "tilt_and_thrust",
]
