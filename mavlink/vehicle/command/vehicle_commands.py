"""Orders that arm, change the mode, or move the vehicle."""

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

from mavlink import CUSTOM_MODE, STANDARD_MODES, Mode, is_maneuvering, positions
from mavlink.missions import MissionCommand, first_item_seq
from mavlink.vehicle.command.guided_commands import (
    GLOBAL,
    NO_PLACE,
    apply_guided_speed,
    execute_item,
    go_to,
    land,
    orbit,
    return_home,
    start_manual_control,
    take_off,
)
from mavlink.vehicle.command.hold_and_abort import VehicleControl
from mavlink.vehicle.command.offboard import OffboardTarget
from mavlink.vehicle.command.relays_lights_buttons import Relays
from mavlink.vehicle.command.request import DONE, CommandRequest, CommandResult, Finish, MavResult
from mavlink.vehicle.mission import NO_PLAN, PlanReply, seq_to_item_number
from mavlink.vehicle.session import Session
from support import wgs84

FORCE = 21196
FORCED_ARMING = FORCE, 2989  # the latter is ArduPilot's own number
GLOBAL_FRAMES, RELATIVE_FRAMES = (0, 5), (3, 6)  # MAV_FRAME
UNCHANGED, USUAL = -1.0, -2.0  # instead of a speed
FARTHEST_HOME = 50_000.0  # m from the vehicle


class CommandTargets(NamedTuple):
    """Parts of the vehicle that commands act on."""

    control: VehicleControl
    offboard: OffboardTarget
    relays: Relays


def set_mode(
    targets: CommandTargets, session: Session, mode: Mode, number: int, finish: Finish, now: float
) -> CommandResult | None:
    """Set a mode if possible: HOLD always is, and so is the present mode; MANUAL ends what a ground station asked for.

    `number` is that by which the ground station calls it in its flavor, -1 if it does not.
    """
    control = targets.control
    before = control.model.mode
    reply: CommandResult | None = None
    match mode:
        case Mode.HOLD | Mode.GUIDED:
            control.hold(now, lambda _: finish(DONE))
            mode = Mode.HOLD  # in ArduPilot's GUIDED mode a vehicle holds until it gets a place
        case Mode.MANUAL if (
            control.model.active_guided_plan_id or not is_maneuvering(control.model.latest.vehicle)
        ) and not control.model.airborne:
            if control.model.active_guided_plan_id:
                control.plans.stop(now)
            control.model.held = False
            reply = DONE
        case _ if mode is before and not (mode is Mode.MISSION and control.mission.flies_replaced_mission):
            reply = DONE
        case Mode.MISSION if control.mission.plan is None:
            return CommandResult(MavResult.DENIED, f"Mode MISSION denied: {NO_PLAN}")
        case Mode.MISSION:
            _start(targets, session, None, finish, now)
        case Mode.RETURN:
            reply = return_home(control, finish, now)
        case Mode.LAND:
            reply = land(control, (math.nan, math.nan), finish, now)
        case Mode.OFFBOARD:
            reply = targets.offboard.follow(finish, now, streams=True)
        case Mode.TELEOPERATION:
            reply = start_manual_control(control, finish, now)
        case Mode.TAKEOFF:
            reply = take_off(control, None, math.nan, finish, now)
        case _:
            return CommandResult(MavResult.DENIED, f"Mode {mode.name} denied: {_choices(targets, session)}")
    if reply is None or reply.result is MavResult.ACCEPTED:
        control.model.remember_mode_number(session.flavor, mode, number)
    return reply


def _choices(targets: CommandTargets, session: Session) -> str:
    names = [mode.name for mode, _ in session.flavor.modes(targets.control.model.kind)]
    return f"there are {', '.join(names)}"


def _start(targets: CommandTargets, session: Session, number: int | None, finish: Finish, now: float) -> None:
    def judge(outcome: PlanReply) -> None:
        finish(DONE if outcome.done else CommandResult(MavResult.FAILED, f"Cannot start the mission: {outcome.reason}"))

    targets.control.mission.start(judge, now, number)


def _arm(targets: CommandTargets, session: Session, order: CommandRequest, now: float) -> CommandResult:
    control, wish = targets.control, order.integer_parameter(1)
    force = order.integer_parameter(2) in (FORCED_ARMING if wish else (FORCE,))
    if wish not in (0, 1):
        return CommandResult(MavResult.DENIED, "Arming denied: parameter 1 is neither 0 nor 1")
    if wish and not control.model.armed_or_moving and control.model.prearm_failure and not force:
        return CommandResult(MavResult.DENIED, f"Arming denied: {control.model.prearm_failure}")
    if not wish and control.model.airborne:
        return CommandResult(MavResult.DENIED, "Disarming denied: the vehicle is in the air")
    if not wish and is_maneuvering(control.model.latest.vehicle):
        if not force and control.model.mode is not Mode.HOLD:
            return CommandResult(MavResult.DENIED, "Disarming denied: the vehicle is executing a maneuver")
        control.plans.stop(now)
    control.model.armed = bool(wish)
    return DONE


def _do_set_mode(targets: CommandTargets, session: Session, order: CommandRequest, now: float) -> CommandResult | None:
    base, main, sub = order.integer_parameter(1), order.integer_parameter(2), order.integer_parameter(3) or 0
    if base is None or not base & CUSTOM_MODE or main is None or main < 0 or not 0 <= sub < 256:
        return CommandResult(MavResult.DENIED, "Mode denied: only custom modes are supported")
    number = session.flavor.commanded_mode_number(main, sub)
    mode = session.flavor.mode(targets.control.model.kind, number)
    return set_mode(targets, session, mode, number, order.finish, now)


def _do_set_standard_mode(
    targets: CommandTargets, session: Session, order: CommandRequest, now: float
) -> CommandResult | None:
    return set_mode(
        targets, session, STANDARD_MODES.get(order.integer_parameter(1) or 0, Mode.OTHER), -1, order.finish, now
    )


def _mission_start(targets: CommandTargets, session: Session, order: CommandRequest, now: float) -> None:
    first = order.integer_parameter(1) or 0
    _start(targets, session, first - first_item_seq(session.flavor) if first > 0 else None, order.finish, now)


def _pause_or_continue(
    targets: CommandTargets, session: Session, order: CommandRequest, now: float
) -> CommandResult | None:
    wish = order.integer_parameter(1)
    if wish == 0:
        return set_mode(targets, session, Mode.HOLD, -1, order.finish, now)
    if wish == 1:
        _start(targets, session, None, order.finish, now)
        return None
    return CommandResult(MavResult.DENIED, "Parameter 1 is neither 0 (pause) nor 1 (continue)")


def _set_current(targets: CommandTargets, session: Session, order: CommandRequest, now: float) -> CommandResult | None:
    """Continue at an item, also by the older message; -1 is the present one, or with parameter 2 the first."""
    mission, seq = targets.control.mission, order.integer_parameter(1)
    number = -1 if seq is None else seq_to_item_number(seq, session)
    if seq == -1:
        number = 0 if order.integer_parameter(2) == 1 else mission.current

    def judge(outcome: PlanReply) -> None:
        order.finish(
            DONE if outcome.done else CommandResult(MavResult.FAILED, f"Cannot continue there: {outcome.reason}")
        )

    if not mission.set_current(number, judge, now):
        return CommandResult(MavResult.DENIED, f"No item from {order.params[0]:g} on moves the vehicle")
    session.build_and_send("MISSION_CURRENT", now)
    return None


def _reposition(targets: CommandTargets, session: Session, order: CommandRequest, now: float) -> CommandResult | None:
    return go_to(targets.control, order.lat_lon, order.frame, order.params[6], order.params[0], order.finish, now)


def _take_off(targets: CommandTargets, session: Session, order: CommandRequest, now: float) -> CommandResult | None:
    """Take off; in COMMAND_LONG the altitude is above home for ArduPilot, and above the sea for PX4."""
    plain = GLOBAL if session.flavor.name == "px4" else None
    frame = plain if order.frame is None else order.frame
    return take_off(targets.control, frame, order.params[6], order.finish, now)


def _waypoint(targets: CommandTargets, session: Session, order: CommandRequest, now: float) -> CommandResult | None:
    """NAV_WAYPOINT and NAV_LOITER_UNLIM as orders: go there and stay, without a place hold."""
    if any(map(math.isnan, order.lat_lon)) or order.lat_lon == (0.0, 0.0):
        return set_mode(targets, session, Mode.HOLD, -1, order.finish, now)
    return go_to(targets.control, order.lat_lon, order.frame, order.params[6], -1.0, order.finish, now)


def _loiter(targets: CommandTargets, session: Session, order: CommandRequest, now: float) -> CommandResult | None:
    params = [*order.params[:4], *order.lat_lon, order.params[6]]
    return execute_item(targets.control, MissionCommand(order.command), params, order.frame, order.finish, now)


def _set_relay(targets: CommandTargets, session: Session, order: CommandRequest, now: float) -> CommandResult:
    return targets.relays.set_relay(order.integer_parameter(1), order.integer_parameter(2))


def _set_servo(targets: CommandTargets, session: Session, order: CommandRequest, now: float) -> CommandResult:
    return targets.relays.set_light_brightness(order.integer_parameter(1), order.params[1])


def _change_altitude(
    targets: CommandTargets, session: Session, order: CommandRequest, now: float
) -> CommandResult | None:
    z, frame = order.params[0], order.integer_parameter(2)
    return go_to(targets.control, NO_PLACE, frame, z, -1.0, order.finish, now)


def _terminate(targets: CommandTargets, session: Session, order: CommandRequest, now: float) -> CommandResult:
    if order.integer_parameter(1) != 1:
        return CommandResult(MavResult.DENIED, "Termination denied: parameter 1 is not 1")
    targets.control.abort(now)
    return DONE


def _land(targets: CommandTargets, session: Session, order: CommandRequest, now: float) -> CommandResult | None:
    return land(targets.control, order.lat_lon, order.finish, now)


def _return(targets: CommandTargets, session: Session, order: CommandRequest, now: float) -> CommandResult | None:
    return return_home(targets.control, order.finish, now)


def _orbit(targets: CommandTargets, session: Session, order: CommandRequest, now: float) -> CommandResult | None:
    radius, speed = order.params[0], order.params[1]
    return orbit(targets.control, order.lat_lon, (order.frame, order.params[6]), radius, speed, order.finish, now)


def _change_speed(targets: CommandTargets, session: Session, order: CommandRequest, now: float) -> CommandResult | None:
    """The speed of what a ground station has asked for and asks for next; -1 leaves it, -2 is the usual one."""
    control, kind, speed = targets.control, order.integer_parameter(1), order.params[1]
    if kind not in (0, 1):
        return CommandResult(
            MavResult.DENIED, "Speed denied: parameter 1 must be 0 (through air or water) or 1 (over ground)"
        )
    if control.model.mode is Mode.MISSION:
        return CommandResult(MavResult.DENIED, "Speed denied: the speeds of a mission are in its items")
    if speed == UNCHANGED:
        return DONE
    if not (0.0 < speed <= control.model.limits.max_speed or speed == USUAL):
        return CommandResult(
            MavResult.DENIED, f"Speed denied: {speed:g} m/s is not between 0 and {control.model.limits.max_speed:g} m/s"
        )
    control.model.chosen_speed = 0.0 if speed == USUAL else speed
    return apply_guided_speed(control, order.finish, now)


def _set_home(targets: CommandTargets, session: Session, order: CommandRequest, now: float) -> CommandResult:
    """Home is here, or at a place; that of a vessel stays at the surface. As in ArduPilot, 0, 0 is here, too."""
    control, (lat, lon), altitude = targets.control, order.lat_lon, order.params[6]
    found = control.model.state_and_position()
    if found is None:
        return CommandResult(MavResult.TEMPORARILY_REJECTED, "The position is unknown")
    here = found[1]
    if order.integer_parameter(1) == 1 or (lat, lon) == (0.0, 0.0):
        lat, lon, altitude = here.lat, here.lon, here.altitude
    elif order.frame in RELATIVE_FRAMES:
        altitude += here.altitude - here.relative
    elif order.frame is not None and order.frame not in GLOBAL_FRAMES:
        return CommandResult(MavResult.UNSUPPORTED_FRAME, f"Home denied: frame {order.frame} has no meaning for it")
    home = positions.home_at(lat, lon, altitude, afloat=control.model.kind.afloat, undulation=control.model.undulation)
    if home is None:
        return CommandResult(MavResult.DENIED, "Home denied: it has no latitude, longitude and altitude on earth")
    away = math.hypot(*wgs84.displacement(here.lat, here.lon, 0.0, lat, lon, 0.0))
    if away > FARTHEST_HOME:
        return CommandResult(MavResult.DENIED, f"Home denied: it would be {away / 1e3:.0f} km from the vehicle")
    control.model.home = home
    session.build_and_send("HOME_POSITION", now)
    return DONE


def _reboot(targets: CommandTargets, session: Session, order: CommandRequest, now: float) -> CommandResult:
    if targets.control.model.armed_or_moving:
        return CommandResult(MavResult.DENIED, "Restart denied: the vehicle is armed or moving")
    return CommandResult(
        MavResult.DENIED, "Restart denied: the vehicle's program and computer are not restarted by messages"
    )


COMMANDS: Mapping[int, Callable[[CommandTargets, Session, CommandRequest, float], CommandResult | None]] = {
    16: _waypoint,
    17: _waypoint,
    18: _loiter,
    19: _loiter,
    20: _return,
    21: _land,
    22: _take_off,
    34: _orbit,
    176: _do_set_mode,
    178: _change_speed,
    179: _set_home,
    181: _set_relay,
    183: _set_servo,
    185: _terminate,
    186: _change_altitude,
    192: _reposition,
    193: _pause_or_continue,
    224: _set_current,
    246: _reboot,
    262: _do_set_standard_mode,
    300: _mission_start,
    400: _arm,
}
