"""Commands of ground stations, what they do to the vehicle, and steering by hand, by targets and by joystick."""

from mavlink.vehicle.command import message_requests
from mavlink.vehicle.command.command_service import Command, CommandService
from mavlink.vehicle.command.gcs_failsafe import ACTIONS, GcsFailsafe
from mavlink.vehicle.command.hold_and_abort import VehicleControl
from mavlink.vehicle.command.message_requests import make_banner_handler
from mavlink.vehicle.command.offboard import OffboardTarget
from mavlink.vehicle.command.read_only import is_order, refuse_if_read_only
from mavlink.vehicle.command.relays_lights_buttons import RelayNames, Relays, parse_button, parse_light
from mavlink.vehicle.command.request import DONE, CommandRequest, CommandResult, MavResult
from mavlink.vehicle.command.setpoint_service import SetpointService, is_guided_item
from mavlink.vehicle.command.vehicle_commands import COMMANDS, CommandTargets

__all__ = [
    "ACTIONS",
    "COMMANDS",
    "DONE",
    "Command",
    "CommandRequest",
    "CommandResult",
    "CommandService",
    "CommandTargets",
    "GcsFailsafe",
    "MavResult",
    "OffboardTarget",
    "RelayNames",
    "Relays",
    "SetpointService",
    "VehicleControl",
    "is_guided_item",
    "is_order",
    "make_banner_handler",
    "message_requests",
    "parse_button",
    "parse_light",
    "refuse_if_read_only",
]
