"""The side of a companion computer: leads an autopilot by MAVLink, without sockets, clocks or threads.

Bytes and messages go in by `receive`, with the time (s); frames come out through the port or the function that each
part is given. `tick` does what is due, at `next_deadline` or in a fixed rhythm.
"""

from mavlink.autopilot.boot_clock import BootClock
from mavlink.autopilot.command_client import ACCEPTED, DROPPED, SILENT, CommandClient, OnResult, result_text
from mavlink.autopilot.connection import AutopilotConnection, FramePort, message_rates
from mavlink.autopilot.gps_input import gps_input_fields, is_usable_fix, usbl_fix
from mavlink.autopilot.guided_goal import GuidedGoal
from mavlink.autopilot.guided_mode_controller import ModeController
from mavlink.autopilot.health import CRITICAL, NAVIGATION, SensorHealth, describe_autopilot
from mavlink.autopilot.heartbeat import HeartbeatWatch
from mavlink.autopilot.leg import ArrivalTolerance, Leg, ReportedPosition, path_height_above_home
from mavlink.autopilot.leg_progress import LegProgress
from mavlink.autopilot.mission_builder import LandingApproach, MissionBuilder, choose_landing_approach
from mavlink.autopilot.mission_client import MissionClient, MissionPhase
from mavlink.autopilot.mission_map import MissionMap
from mavlink.autopilot.telemetry import Telemetry
from mavlink.autopilot.vehicle_modes import ARDUPILOT, PX4, SteeredVehicle, steered_vehicle

__all__ = [
    "ACCEPTED",
    "ARDUPILOT",
    "CRITICAL",
    "DROPPED",
    "NAVIGATION",
    "PX4",
    "SILENT",
    "ArrivalTolerance",
    "AutopilotConnection",
    "BootClock",
    "CommandClient",
    "FramePort",
    "GuidedGoal",
    "HeartbeatWatch",
    "LandingApproach",
    "Leg",
    "LegProgress",
    "MissionBuilder",
    "MissionClient",
    "MissionMap",
    "MissionPhase",
    "ModeController",
    "OnResult",
    "ReportedPosition",
    "SensorHealth",
    "SteeredVehicle",
    "Telemetry",
    "choose_landing_approach",
    "describe_autopilot",
    "gps_input_fields",
    "is_usable_fix",
    "message_rates",
    "path_height_above_home",
    "result_text",
    "steered_vehicle",
    "usbl_fix",
]
