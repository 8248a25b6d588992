"""Guidance of an autopilot, as messages: setpoints in a stream, or one command for a leg."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from mavlink import Fields
from mavlink.autopilot.leg import Leg, ReportedPosition
from mavlink.autopilot.vehicle_modes import SteeredVehicle
from mavlink.positions import degrees_e7

TAKEOFF, CHANGE_SPEED, REPOSITION, ORBIT = 22, 178, 192, 34  # MAV_CMD
GLOBAL, RELATIVE = 0, 6  # MAV_FRAME: above the sea, above home
ONLY_POSITION = 0x0DF8  # ignore velocity, acceleration and yaw of a position target
AIR_SPEED, GROUND_SPEED = 0, 1
LEAD_OFFBOARD = 1.05  # s; PX4 approaches a setpoint by 0.95/s of its distance (MPC_XY_P)


class CommandMessage(NamedTuple):
    """A command: what it is for people, the message that carries it, its fields."""

    what: str
    message: str
    fields: Fields


def command_message(what: str, number: int, values: Sequence[float], place: Fields | None = None) -> CommandMessage:
    """A COMMAND_LONG with its first parameters; with a place, a COMMAND_INT."""
    numbered = {f"param{count}": value for count, value in enumerate(values, 1)}
    message = "COMMAND_LONG" if place is None else "COMMAND_INT"
    return CommandMessage(what, message, {"command": number, **numbered, **(place or {})})


def offboard_setpoint(leg: Leg | None, at: ReportedPosition) -> Fields:
    """The setpoint of PX4's OFFBOARD for a leg now; without one, the place where it is."""
    if leg is None:
        (lat, lon), height = (at.lat, at.lon), at.above_home
    else:
        (lat, lon), height = leg.point_ahead(at, LEAD_OFFBOARD), leg.height
    return position_target(lat, lon, height)


def position_target(lat: float, lon: float, height: float) -> Fields:
    """SET_POSITION_TARGET_GLOBAL_INT for a place (rad) and a height (m) above home."""
    place = {"lat_int": degrees_e7(lat), "lon_int": degrees_e7(lon), "alt": height}
    return {"coordinate_frame": RELATIVE, "type_mask": ONLY_POSITION, **place}


def leg_command(vehicle: SteeredVehicle, leg: Leg, at: ReportedPosition) -> CommandMessage:
    """The command that leads along a whole leg; altitudes are above the sea."""
    height = at.amsl - at.above_home + leg.height
    place: Fields = {"frame": GLOBAL, "x": degrees_e7(leg.lat), "y": degrees_e7(leg.lon), "z": height}
    if leg.radius and vehicle.orbit is not None:
        return command_message("an orbit", ORBIT, (leg.side * leg.radius, leg.speed, 0.0, math.nan), place)
    if vehicle.px4:
        return command_message("the leg", REPOSITION, (leg.speed, 1.0, leg.side * leg.radius, math.nan), place)
    counter = 1.0 if leg.side < 0 else 0.0  # ArduPlane takes the sense from here, and ignores a negative radius
    return command_message("the leg", REPOSITION, (leg.speed, 1.0, leg.radius, counter), place)


def takeoff_command(vehicle: SteeredVehicle, leg: Leg, at: ReportedPosition) -> CommandMessage:
    """The takeoff to the height of a leg: for PX4 above the sea, for ArduPilot above home."""
    height = at.amsl - at.above_home + leg.height if vehicle.px4 else leg.height
    place = (math.nan, math.nan, math.nan) if vehicle.px4 else (0.0, 0.0, 0.0)
    return command_message("a takeoff", TAKEOFF, (0.0, 0.0, 0.0, *place, height))


def speed_command(vehicle: SteeredVehicle, speed: float) -> CommandMessage:
    kind = AIR_SPEED if vehicle.roams else GROUND_SPEED
    return command_message("the speed", CHANGE_SPEED, (kind, speed, -1.0))
