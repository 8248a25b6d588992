"""Conversion of each command of a mission to a plan."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import imc
from mavlink.missions.conversion_context import FARTHEST_UP, ConversionContext
from mavlink.missions.enums import PARAMETERS, POSITIONS, MissionCommand, MissionError, MissionResult
from mavlink.missions.item import Item, to_float32
from mavlink.missions.plan_builder import LONGEST, WIDEST, PlanBuilder

STEEPEST, ROUND = 90.0, 360.0  # °
SPEED_KINDS = (0, 1)  # of DO_CHANGE_SPEED: through the air or water, over ground
UNCHANGED, USUAL = -1.0, -2.0  # instead of a speed
FASTEST = 100.0  # m/s or %; plans may not ask for more
SLOWEST = 0.01  # m/s or %; a circle at less takes longer than any number holds


def _waypoint(builder: PlanBuilder, item: Item) -> None:
    spline = item.command == MissionCommand.NAV_SPLINE_WAYPOINT  # has no other parameters than the time
    seconds = builder.parameter(item, 1, 0.0, LONGEST, what="hold time")
    reach = 0.0 if spline else builder.parameter(item, 2, 0.0, WIDEST, what="acceptance radius")
    if not spline and builder.parameter(item, 3, -WIDEST, WIDEST, what="pass radius"):
        raise MissionError(MissionResult.INVALID_PARAM3, "the vehicle cannot pass at a distance")
    yaw = 0.0 if spline else builder.parameter(item, 4, -ROUND, ROUND, what="yaw")
    leg = builder.fields_for_item(item)
    builder.add(imc.Goto(**leg, yaw=math.radians(yaw)))
    if seconds:
        builder.add_stay((leg["lat"], leg["lon"]), seconds, max(reach, builder.context.radius))


def _loiter(builder: PlanBuilder, item: Item) -> None:
    radius, leg = builder.radius(item, 3), builder.fields_for_item(item)
    builder.add_stay((leg["lat"], leg["lon"]), 0.0, radius)


def _loiter_time(builder: PlanBuilder, item: Item) -> None:
    seconds = builder.parameter(item, 1, 0.0, LONGEST, default=None, what="time")
    radius, leg = builder.radius(item, 3), builder.fields_for_item(item)
    builder.add_stay((leg["lat"], leg["lon"]), max(1.0, seconds), radius)


def _loiter_turns(builder: PlanBuilder, item: Item) -> None:
    turns = builder.parameter(item, 1, 0.0, LONGEST, default=None, what="number of turns")
    radius, leg = builder.radius(item, 3), builder.fields_for_item(item)
    seconds = turns_duration(turns, radius, leg, builder.context)
    if not 1 <= seconds <= LONGEST:
        raise MissionError(MissionResult.INVALID_PARAM1, f"{turns:g} turns take {seconds} s, not 1 to {LONGEST} s")
    builder.add_circle({**leg, "radius": abs(radius), "duration": seconds}, counter=radius < 0.0)


def turns_duration(turns: float, radius: float, leg: Mapping[str, Any], context: ConversionContext) -> int:
    """Duration (s) of turns. Raises MissionError for a speed that is not in m/s."""
    if leg["speed_units"] != imc.SpeedUnits.METERS_PS or not leg["speed"] > 0.0:
        raise MissionError(MissionResult.INVALID_PARAM1, "turns need a speed in m/s, not in %")
    return round(turns * math.tau * max(abs(radius), context.tightest) / leg["speed"])


def _loiter_to_alt(builder: PlanBuilder, item: Item) -> None:
    radius, before = abs(builder.radius(item, 2)), builder.level or builder.context.usual_level
    if builder.context.flies:
        builder.add(imc.Goto(**builder.fields_for_item(item)))
        return
    if not builder.context.dives:
        raise MissionError(MissionResult.UNSUPPORTED, "a boat stays at the surface")
    z, units = builder.level = builder.context.level(item.frame, item.z)
    place, (speed, speed_units) = builder.item_position(item), builder.speed
    lat, lon = place or (0.0, 0.0)
    builder.add(
        imc.Elevator(
            flags=0 if place else imc.Elevator.Flags.CURR_POS,
            lat=lat,
            lon=lon,
            start_z=before.z,
            start_z_units=before.z_units,
            end_z=z,
            end_z_units=units,
            radius=radius,
            speed=speed,
            speed_units=speed_units,
        )
    )


def _delay(builder: PlanBuilder, item: Item) -> None:
    if item.param1 == -1.0:
        raise MissionError(MissionResult.INVALID_PARAM1, "the vehicle cannot wait for a time of day")
    seconds = max(1.0, builder.parameter(item, 1, 0.0, LONGEST, default=None, what="time"))
    if builder.place is None or builder.grounded:
        builder.add(imc.IdleManeuver(duration=math.ceil(seconds)))
    else:
        builder.add_stay(builder.place, seconds, builder.context.radius)


def _return(builder: PlanBuilder, _: Item) -> None:
    home = builder.context.home
    if home is None:
        raise MissionError(MissionResult.ERROR, "home is not known yet")
    place = home.lat, home.lon
    if builder.context.flies:
        builder.add_landing(place)
    elif builder.context.dives:
        builder.add_surfacing(place)
    else:
        builder.add(imc.Goto(**builder.fields_for_place(place)))
    builder.end_mission()


def _land(builder: PlanBuilder, item: Item) -> None:
    if item.frame not in POSITIONS:
        raise MissionError(MissionResult.UNSUPPORTED_FRAME, f"frame {item.frame} has no meaning for a position")
    place = builder.item_position(item)
    if builder.context.dives:
        builder.add_surfacing(place)
        return
    if not builder.context.flies:
        raise MissionError(MissionResult.UNSUPPORTED, "a boat does not land")
    above = builder.parameter(item, 1, -FARTHEST_UP, FARTHEST_UP, what="altitude after an aborted landing")
    if builder.parameter(item, 2, 0.0, 2.0, what="mode of precision landing"):
        raise MissionError(MissionResult.INVALID_PARAM2, "the vehicle has no precision landing")
    yaw = builder.parameter(item, 4, -ROUND, ROUND, what="yaw")
    builder.add_landing(place, abort_z=above, bearing=math.radians(yaw))


def _takeoff(builder: PlanBuilder, item: Item) -> None:
    if not builder.context.flies:
        raise MissionError(MissionResult.UNSUPPORTED, "only an aircraft takes off; a NAV_WAYPOINT begins a dive")
    pitch = builder.parameter(item, 1, -STEEPEST, STEEPEST, what="pitch")
    builder.level = builder.context.level(item.frame, item.z)
    if builder.context.altitude_above_ground(builder.level) <= 0.0:
        raise MissionError(MissionResult.INVALID_PARAM7, f"altitude {item.z:g} m is not above the ground")
    leg = builder.fields_for_place(builder.item_position(item) or (0.0, 0.0))
    builder.add(imc.Takeoff(**leg, takeoff_pitch=math.radians(pitch)))


def _change_speed(builder: PlanBuilder, item: Item) -> None:
    kind = builder.parameter(item, 1, 0.0, 3.0, what="kind of speed")
    if kind not in SPEED_KINDS:
        raise MissionError(MissionResult.INVALID_PARAM1, "the vertical speed cannot be set")
    speed = builder.parameter(item, 2, USUAL, FASTEST, default=UNCHANGED, what="speed")
    throttle = builder.parameter(item, 3, USUAL, FASTEST, default=UNCHANGED, what="throttle")
    if builder.parameter(item, 4, 0.0, 1.0, what="relative speed"):
        raise MissionError(PARAMETERS[3], "a change relative to the present speed is not supported")
    if speed > builder.context.fastest:
        limit = builder.context.fastest
        raise MissionError(MissionResult.INVALID_PARAM2, f"{speed:g} m/s is above the vehicle's {limit:g} m/s")
    if speed >= SLOWEST:
        builder.speed = to_float32(speed), imc.SpeedUnits.METERS_PS
    elif speed == USUAL or (speed == UNCHANGED and throttle == USUAL):
        builder.speed = builder.context.usual_speed
    elif speed != UNCHANGED:
        raise MissionError(MissionResult.INVALID_PARAM2, f"{speed:g} m/s is no speed")
    elif throttle >= SLOWEST:
        if builder.context.flies:
            raise MissionError(MissionResult.INVALID_PARAM3, "an aircraft needs a speed in m/s, not a throttle")
        builder.speed = to_float32(throttle), imc.SpeedUnits.PERCENTAGE


def _camera(builder: PlanBuilder, item: Item) -> None:
    if not builder.context.camera:
        raise MissionError(MissionResult.UNSUPPORTED, "the vehicle has no camera that a plan can switch")
    on = item.command in (MissionCommand.IMAGE_START_CAPTURE, MissionCommand.VIDEO_START_CAPTURE)
    if item.command == MissionCommand.IMAGE_START_CAPTURE and item.param3 > 0.0:
        raise MissionError(MissionResult.INVALID_PARAM3, "a plan only switches a camera on and off")
    if item.command == MissionCommand.DO_SET_CAM_TRIGG_DIST:
        on = item.param1 > 0.0
        if not on and item.param3 == 1.0:
            raise MissionError(MissionResult.INVALID_PARAM3, "a plan only switches a camera on and off")
    builder.pending.append(camera_switch(builder.context, on))


def camera_switch(context: ConversionContext, on: bool) -> imc.SetEntityParameters:
    """The setting that switches the camera."""
    entry = imc.EntityParameter(name=context.switch, value="true" if on else "false")
    return imc.SetEntityParameters(name=context.camera, params=(entry,))


COMMANDS: Mapping[int, Callable[[PlanBuilder, Item], None]] = {
    MissionCommand.NAV_WAYPOINT: _waypoint,
    MissionCommand.NAV_SPLINE_WAYPOINT: _waypoint,
    MissionCommand.NAV_LOITER_UNLIM: _loiter,
    MissionCommand.NAV_LOITER_TIME: _loiter_time,
    MissionCommand.NAV_LOITER_TURNS: _loiter_turns,
    MissionCommand.NAV_LOITER_TO_ALT: _loiter_to_alt,
    MissionCommand.NAV_DELAY: _delay,
    MissionCommand.CONDITION_DELAY: _delay,
    MissionCommand.NAV_RETURN_TO_LAUNCH: _return,
    MissionCommand.NAV_LAND: _land,
    MissionCommand.NAV_TAKEOFF: _takeoff,
    MissionCommand.DO_CHANGE_SPEED: _change_speed,
    MissionCommand.IMAGE_START_CAPTURE: _camera,
    MissionCommand.IMAGE_STOP_CAPTURE: _camera,
    MissionCommand.VIDEO_START_CAPTURE: _camera,
    MissionCommand.VIDEO_STOP_CAPTURE: _camera,
    MissionCommand.DO_SET_CAM_TRIGG_DIST: _camera,
}
"""Converters of each command to maneuvers."""

UNKNOWN: Mapping[int, str] = {
    177: "DO_JUMP is not supported: items are flown once, in their order",
}
