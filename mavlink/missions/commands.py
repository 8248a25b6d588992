"""What each command of a mission becomes in a plan."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import imc
from mavlink.missions.conversion_context import FARTHEST_UP, Settings
from mavlink.missions.enums import PARAMETERS, POSITIONS, Command, MissionResult, Refusal
from mavlink.missions.item import Item, to_float32
from mavlink.missions.plan_builder import LONGEST, WIDEST, Planner

STEEPEST, ROUND = 90.0, 360.0  # °
SPEED_KINDS = (0, 1)  # of DO_CHANGE_SPEED: through the air or water, over ground
UNCHANGED, USUAL = -1.0, -2.0  # instead of a speed
FASTEST = 100.0  # m/s or %; plans may not ask for more
SLOWEST = 0.01  # m/s or %; a circle at less takes longer than any number holds


def _waypoint(planner: Planner, item: Item) -> None:
    spline = item.command == Command.NAV_SPLINE_WAYPOINT  # has no other parameters than the time
    seconds = planner.number(item, 1, 0.0, LONGEST, what="hold time")
    reach = 0.0 if spline else planner.number(item, 2, 0.0, WIDEST, what="acceptance radius")
    if not spline and planner.number(item, 3, -WIDEST, WIDEST, what="pass radius"):
        raise Refusal(MissionResult.INVALID_PARAM3, "the vehicle cannot pass at a distance")
    yaw = 0.0 if spline else planner.number(item, 4, -ROUND, ROUND, what="yaw")
    leg = planner.leg(item)
    planner.add(imc.Goto(**leg, yaw=math.radians(yaw)))
    if seconds:
        planner.stay((leg["lat"], leg["lon"]), seconds, max(reach, planner.settings.radius))


def _loiter(planner: Planner, item: Item) -> None:
    radius, leg = planner.radius(item, 3), planner.leg(item)
    planner.stay((leg["lat"], leg["lon"]), 0.0, radius)


def _loiter_time(planner: Planner, item: Item) -> None:
    seconds = planner.number(item, 1, 0.0, LONGEST, default=None, what="time")
    radius, leg = planner.radius(item, 3), planner.leg(item)
    planner.stay((leg["lat"], leg["lon"]), max(1.0, seconds), radius)


def _loiter_turns(planner: Planner, item: Item) -> None:
    turns = planner.number(item, 1, 0.0, LONGEST, default=None, what="number of turns")
    radius, leg = planner.radius(item, 3), planner.leg(item)
    seconds = duration_of(turns, radius, leg, planner.settings)
    if not 1 <= seconds <= LONGEST:
        raise Refusal(MissionResult.INVALID_PARAM1, f"{turns:g} turns take {seconds} s, not 1 to {LONGEST} s")
    planner.circle({**leg, "radius": abs(radius), "duration": seconds}, counter=radius < 0.0)


def duration_of(turns: float, radius: float, leg: Mapping[str, Any], settings: Settings) -> int:
    """How long (s) turns take. Raises Refusal for a speed that is not in m/s."""
    if leg["speed_units"] != imc.SpeedUnits.METERS_PS or not leg["speed"] > 0.0:
        raise Refusal(MissionResult.INVALID_PARAM1, "turns need a speed in m/s, not in %")
    return round(turns * math.tau * max(abs(radius), settings.tightest) / leg["speed"])


def _loiter_to_alt(planner: Planner, item: Item) -> None:
    radius, before = abs(planner.radius(item, 2)), planner.level or planner.settings.usual_level
    if planner.settings.flies:
        planner.add(imc.Goto(**planner.leg(item)))
        return
    if not planner.settings.dives:
        raise Refusal(MissionResult.UNSUPPORTED, "a boat stays at the surface")
    z, units = planner.level = planner.settings.level(item.frame, item.z)
    place, (speed, speed_units) = planner.where(item), planner.speed
    lat, lon = place or (0.0, 0.0)
    planner.add(
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


def _delay(planner: Planner, item: Item) -> None:
    if item.param1 == -1.0:
        raise Refusal(MissionResult.INVALID_PARAM1, "the vehicle cannot wait for a time of day")
    seconds = max(1.0, planner.number(item, 1, 0.0, LONGEST, default=None, what="time"))
    if planner.place is None or planner.grounded:
        planner.add(imc.IdleManeuver(duration=math.ceil(seconds)))
    else:
        planner.stay(planner.place, seconds, planner.settings.radius)


def _return(planner: Planner, _: Item) -> None:
    home = planner.settings.home
    if home is None:
        raise Refusal(MissionResult.ERROR, "home is not known yet")
    place = home.lat, home.lon
    if planner.settings.flies:
        planner.land(place)
    elif planner.settings.dives:
        planner.surface(place)
    else:
        planner.add(imc.Goto(**planner.at(place)))
    planner.end()


def _land(planner: Planner, item: Item) -> None:
    if item.frame not in POSITIONS:
        raise Refusal(MissionResult.UNSUPPORTED_FRAME, f"frame {item.frame} has no meaning for a position")
    place = planner.where(item)
    if planner.settings.dives:
        planner.surface(place)
        return
    if not planner.settings.flies:
        raise Refusal(MissionResult.UNSUPPORTED, "a boat does not land")
    above = planner.number(item, 1, -FARTHEST_UP, FARTHEST_UP, what="altitude after an aborted landing")
    if planner.number(item, 2, 0.0, 2.0, what="mode of precision landing"):
        raise Refusal(MissionResult.INVALID_PARAM2, "the vehicle has no precision landing")
    yaw = planner.number(item, 4, -ROUND, ROUND, what="yaw")
    planner.land(place, abort_z=above, bearing=math.radians(yaw))


def _takeoff(planner: Planner, item: Item) -> None:
    if not planner.settings.flies:
        raise Refusal(MissionResult.UNSUPPORTED, "only an aircraft takes off; a NAV_WAYPOINT begins a dive")
    pitch = planner.number(item, 1, -STEEPEST, STEEPEST, what="pitch")
    planner.level = planner.settings.level(item.frame, item.z)
    if planner.settings.above_ground(planner.level) <= 0.0:
        raise Refusal(MissionResult.INVALID_PARAM7, f"altitude {item.z:g} m is not above the ground")
    leg = planner.at(planner.where(item) or (0.0, 0.0))
    planner.add(imc.Takeoff(**leg, takeoff_pitch=math.radians(pitch)))


def _change_speed(planner: Planner, item: Item) -> None:
    kind = planner.number(item, 1, 0.0, 3.0, what="kind of speed")
    if kind not in SPEED_KINDS:
        raise Refusal(MissionResult.INVALID_PARAM1, "the vertical speed cannot be set")
    speed = planner.number(item, 2, USUAL, FASTEST, default=UNCHANGED, what="speed")
    throttle = planner.number(item, 3, USUAL, FASTEST, default=UNCHANGED, what="throttle")
    if planner.number(item, 4, 0.0, 1.0, what="relative speed"):
        raise Refusal(PARAMETERS[3], "a change relative to the present speed is not supported")
    if speed > planner.settings.fastest:
        limit = planner.settings.fastest
        raise Refusal(MissionResult.INVALID_PARAM2, f"{speed:g} m/s is above the vehicle's {limit:g} m/s")
    if speed >= SLOWEST:
        planner.speed = to_float32(speed), imc.SpeedUnits.METERS_PS
    elif speed == USUAL or (speed == UNCHANGED and throttle == USUAL):
        planner.speed = planner.settings.usual_speed
    elif speed != UNCHANGED:
        raise Refusal(MissionResult.INVALID_PARAM2, f"{speed:g} m/s is no speed")
    elif throttle >= SLOWEST:
        if planner.settings.flies:
            raise Refusal(MissionResult.INVALID_PARAM3, "an aircraft needs a speed in m/s, not a throttle")
        planner.speed = to_float32(throttle), imc.SpeedUnits.PERCENTAGE


def _camera(planner: Planner, item: Item) -> None:
    if not planner.settings.camera:
        raise Refusal(MissionResult.UNSUPPORTED, "the vehicle has no camera that a plan can switch")
    on = item.command in (Command.IMAGE_START_CAPTURE, Command.VIDEO_START_CAPTURE)
    if item.command == Command.IMAGE_START_CAPTURE and item.param3 > 0.0:
        raise Refusal(MissionResult.INVALID_PARAM3, "a plan only switches a camera on and off")
    if item.command == Command.DO_SET_CAM_TRIGG_DIST:
        on = item.param1 > 0.0
        if not on and item.param3 == 1.0:
            raise Refusal(MissionResult.INVALID_PARAM3, "a plan only switches a camera on and off")
    planner.pending.append(switched(planner.settings, on))


def switched(settings: Settings, on: bool) -> imc.SetEntityParameters:
    """The setting that switches the camera."""
    entry = imc.EntityParameter(name=settings.switch, value="true" if on else "false")
    return imc.SetEntityParameters(name=settings.camera, params=(entry,))


COMMANDS: Mapping[int, Callable[[Planner, Item], None]] = {
    Command.NAV_WAYPOINT: _waypoint,
    Command.NAV_SPLINE_WAYPOINT: _waypoint,
    Command.NAV_LOITER_UNLIM: _loiter,
    Command.NAV_LOITER_TIME: _loiter_time,
    Command.NAV_LOITER_TURNS: _loiter_turns,
    Command.NAV_LOITER_TO_ALT: _loiter_to_alt,
    Command.NAV_DELAY: _delay,
    Command.CONDITION_DELAY: _delay,
    Command.NAV_RETURN_TO_LAUNCH: _return,
    Command.NAV_LAND: _land,
    Command.NAV_TAKEOFF: _takeoff,
    Command.DO_CHANGE_SPEED: _change_speed,
    Command.IMAGE_START_CAPTURE: _camera,
    Command.IMAGE_STOP_CAPTURE: _camera,
    Command.VIDEO_START_CAPTURE: _camera,
    Command.VIDEO_STOP_CAPTURE: _camera,
    Command.DO_SET_CAM_TRIGG_DIST: _camera,
}
"""How each command becomes maneuvers."""

UNKNOWN: Mapping[int, str] = {
    177: "DO_JUMP is not supported: items are flown once, in their order",
}
