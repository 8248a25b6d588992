"""Orders that arm, change the mode, or move the vehicle."""

import math
from collections.abc import Callable, Mapping

from mavlink import CUSTOM_MODE, STANDARD_MODES, Mode, is_moving, positions
from mavlink.missions import MissionCommand, first_item
from support import wgs84
from tasks.transports.mavlink_protocol.errands import (
    GLOBAL,
    NO_PLACE,
    execute,
    go,
    hasten,
    land,
    orbit,
    return_home,
    steer,
    take_off,
)
from tasks.transports.mavlink_protocol.helm import Outcome
from tasks.transports.mavlink_protocol.mission import NO_PLAN
from tasks.transports.mavlink_protocol.mission_transfer import number_of
from tasks.transports.mavlink_protocol.orders import DONE, Finish, Order, Reply, Result
from tasks.transports.mavlink_protocol.session import Session

FORCE = 21196
FORCED_ARMING = FORCE, 2989  # the latter is ArduPilot's own number
GLOBAL_FRAMES, RELATIVE_FRAMES = (0, 5), (3, 6)  # MAV_FRAME
UNCHANGED, USUAL = -1.0, -2.0  # instead of a speed
FARTHEST_HOME = 50_000.0  # m from the vehicle


def set_mode(session: Session, mode: Mode, number: int, finish: Finish, now: float) -> Reply | None:
    """Set a mode if possible: HOLD always is, and so is the present mode; MANUAL ends what a ground station asked for.

    `number` is that by which the ground station calls it in its flavor, -1 if it does not.
    """
    system = session.autopilot
    before = system.mode
    reply: Reply | None = None
    match mode:
        case Mode.HOLD | Mode.GUIDED:
            system.hold(now, lambda _: finish(DONE))
            mode = Mode.HOLD  # in ArduPilot's GUIDED mode a vehicle holds until it gets a place
        case Mode.MANUAL if (system.errand or not is_moving(system.figures.vehicle)) and not system.aloft:
            if system.errand:
                system.helm.stop(now)
            system.held = False
            reply = DONE
        case _ if mode is before and not (mode is Mode.MISSION and system.mission.is_obsolete):
            reply = DONE
        case Mode.MISSION if system.mission.plan is None:
            return Reply(Result.DENIED, f"Mode MISSION denied: {NO_PLAN}")
        case Mode.MISSION:
            _start(session, None, finish, now)
        case Mode.RETURN:
            reply = return_home(system, finish, now)
        case Mode.LAND:
            reply = land(system, (math.nan, math.nan), finish, now)
        case Mode.OFFBOARD:
            reply = system.target.follow(finish, now, streams=True)
        case Mode.TELEOPERATION:
            reply = steer(system, finish, now)
        case Mode.TAKEOFF:
            reply = take_off(system, None, math.nan, finish, now)
        case _:
            return Reply(Result.DENIED, f"Mode {mode.name} denied: {_choices(session)}")
    if reply is None or reply.result is Result.ACCEPTED:
        system.choose_number(session.flavour, mode, number)
    return reply


def _choices(session: Session) -> str:
    names = [mode.name for mode, _ in session.flavour.modes(session.autopilot.kind)]
    return f"there are {', '.join(names)}"


def _start(session: Session, number: int | None, finish: Finish, now: float) -> None:
    def judge(outcome: Outcome) -> None:
        finish(DONE if outcome.done else Reply(Result.FAILED, f"Cannot start the mission: {outcome.reason}"))

    session.autopilot.mission.start(judge, now, number)


def _arm(session: Session, order: Order, now: float) -> Reply:
    system, wish = session.autopilot, order.number(1)
    force = order.number(2) in (FORCED_ARMING if wish else (FORCE,))
    if wish not in (0, 1):
        return Reply(Result.DENIED, "Arming denied: parameter 1 is neither 0 nor 1")
    if wish and not system.armed_or_moving and system.obstacle and not force:
        return Reply(Result.DENIED, f"Arming denied: {system.obstacle}")
    if not wish and system.aloft:
        return Reply(Result.DENIED, "Disarming denied: the vehicle is in the air")
    if not wish and is_moving(system.figures.vehicle):
        if not force and system.mode is not Mode.HOLD:
            return Reply(Result.DENIED, "Disarming denied: the vehicle is executing a maneuver")
        system.helm.stop(now)
    system.armed = bool(wish)
    return DONE


def _do_set_mode(session: Session, order: Order, now: float) -> Reply | None:
    base, main, sub = order.number(1), order.number(2), order.number(3) or 0
    if base is None or not base & CUSTOM_MODE or main is None or main < 0 or not 0 <= sub < 256:
        return Reply(Result.DENIED, "Mode denied: only custom modes are supported")
    number = session.flavour.commanded_number(main, sub)
    mode = session.flavour.mode(session.autopilot.kind, number)
    return set_mode(session, mode, number, order.finish, now)


def _do_set_standard_mode(session: Session, order: Order, now: float) -> Reply | None:
    return set_mode(session, STANDARD_MODES.get(order.number(1) or 0, Mode.OTHER), -1, order.finish, now)


def _mission_start(session: Session, order: Order, now: float) -> None:
    first = order.number(1) or 0
    _start(session, first - first_item(session.flavour) if first > 0 else None, order.finish, now)


def _pause_or_continue(session: Session, order: Order, now: float) -> Reply | None:
    wish = order.number(1)
    if wish == 0:
        return set_mode(session, Mode.HOLD, -1, order.finish, now)
    if wish == 1:
        _start(session, None, order.finish, now)
        return None
    return Reply(Result.DENIED, "Parameter 1 is neither 0 (pause) nor 1 (continue)")


def _set_current(session: Session, order: Order, now: float) -> Reply | None:
    """Go on at an item, also by the older message; -1 is the present one, or with parameter 2 the first."""
    mission, seq = session.autopilot.mission, order.number(1)
    number = -1 if seq is None else number_of(seq, session)
    if seq == -1:
        number = 0 if order.number(2) == 1 else mission.current

    def judge(outcome: Outcome) -> None:
        order.finish(DONE if outcome.done else Reply(Result.FAILED, f"Cannot go on there: {outcome.reason}"))

    if not mission.choose(number, judge, now):
        return Reply(Result.DENIED, f"No item from {order.params[0]:g} on moves the vehicle")
    session.send_now("MISSION_CURRENT", now)
    return None


def _reposition(session: Session, order: Order, now: float) -> Reply | None:
    return go(session.autopilot, order.place, order.frame, order.params[6], order.params[0], order.finish, now)


def _take_off(session: Session, order: Order, now: float) -> Reply | None:
    """In COMMAND_LONG the altitude is above home for ArduPilot, and above the sea for PX4."""
    plain = GLOBAL if session.flavour.name == "px4" else None
    frame = plain if order.frame is None else order.frame
    return take_off(session.autopilot, frame, order.params[6], order.finish, now)


def _waypoint(session: Session, order: Order, now: float) -> Reply | None:
    """NAV_WAYPOINT and NAV_LOITER_UNLIM as orders: go there and stay, without a place hold."""
    if any(map(math.isnan, order.place)) or order.place == (0.0, 0.0):
        return set_mode(session, Mode.HOLD, -1, order.finish, now)
    return go(session.autopilot, order.place, order.frame, order.params[6], -1.0, order.finish, now)


def _loiter(session: Session, order: Order, now: float) -> Reply | None:
    params = [*order.params[:4], *order.place, order.params[6]]
    return execute(session.autopilot, MissionCommand(order.command), params, order.frame, order.finish, now)


def _set_relay(session: Session, order: Order, now: float) -> Reply:
    return session.autopilot.switches.relay(order.number(1), order.number(2))


def _set_servo(session: Session, order: Order, now: float) -> Reply:
    return session.autopilot.switches.servo(order.number(1), order.params[1])


def _change_altitude(session: Session, order: Order, now: float) -> Reply | None:
    z, frame = order.params[0], order.number(2)
    return go(session.autopilot, NO_PLACE, frame, z, -1.0, order.finish, now)


def _terminate(session: Session, order: Order, now: float) -> Reply:
    if order.number(1) != 1:
        return Reply(Result.DENIED, "Termination denied: parameter 1 is not 1")
    session.autopilot.abort(now)
    return DONE


def _land(session: Session, order: Order, now: float) -> Reply | None:
    return land(session.autopilot, order.place, order.finish, now)


def _return(session: Session, order: Order, now: float) -> Reply | None:
    return return_home(session.autopilot, order.finish, now)


def _orbit(session: Session, order: Order, now: float) -> Reply | None:
    radius, speed = order.params[0], order.params[1]
    return orbit(session.autopilot, order.place, (order.frame, order.params[6]), radius, speed, order.finish, now)


def _change_speed(session: Session, order: Order, now: float) -> Reply | None:
    """The speed of what a ground station has asked for and asks for next; -1 leaves it, -2 is the usual one."""
    system, kind, speed = session.autopilot, order.number(1), order.params[1]
    if kind not in (0, 1):
        return Reply(Result.DENIED, "Speed denied: parameter 1 must be 0 (through air or water) or 1 (over ground)")
    if system.mode is Mode.MISSION:
        return Reply(Result.DENIED, "Speed denied: the speeds of a mission are in its items")
    if speed == UNCHANGED:
        return DONE
    if not (0.0 < speed <= system.limits.fastest or speed == USUAL):
        return Reply(Result.DENIED, f"Speed denied: {speed:g} m/s is not between 0 and {system.limits.fastest:g} m/s")
    system.chosen_speed = 0.0 if speed == USUAL else speed
    return hasten(system, order.finish, now)


def _set_home(session: Session, order: Order, now: float) -> Reply:
    """Home is here, or at a place; that of a vessel stays at the surface. As in ArduPilot, 0, 0 is here, too."""
    system, (lat, lon), altitude = session.autopilot, order.place, order.params[6]
    found = system.place()
    if found is None:
        return Reply(Result.TEMPORARILY_REJECTED, "The position is unknown")
    here = found[1]
    if order.number(1) == 1 or (lat, lon) == (0.0, 0.0):
        lat, lon, altitude = here.lat, here.lon, here.altitude
    elif order.frame in RELATIVE_FRAMES:
        altitude += here.altitude - here.relative
    elif order.frame is not None and order.frame not in GLOBAL_FRAMES:
        return Reply(Result.UNSUPPORTED_FRAME, f"Home denied: frame {order.frame} has no meaning for it")
    home = positions.home_at(lat, lon, altitude, afloat=system.kind.afloat, undulation=system.undulation)
    if home is None:
        return Reply(Result.DENIED, "Home denied: it has no latitude, longitude and altitude on earth")
    away = math.hypot(*wgs84.displacement(here.lat, here.lon, 0.0, lat, lon, 0.0))
    if away > FARTHEST_HOME:
        return Reply(Result.DENIED, f"Home denied: it would be {away / 1e3:.0f} km from the vehicle")
    system.home = home
    session.send_now("HOME_POSITION", now)
    return DONE


def _reboot(session: Session, order: Order, now: float) -> Reply:
    if session.autopilot.armed_or_moving:
        return Reply(Result.DENIED, "Restart denied: the vehicle is armed or moving")
    return Reply(Result.DENIED, "Restart denied: the vehicle's program and computer are not restarted by messages")


COMMANDS: Mapping[int, Callable[[Session, Order, float], Reply | None]] = {
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
