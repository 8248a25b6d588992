"""Orders that arm, change the mode, or move the vehicle."""

import math
from collections.abc import Callable, Mapping

from mavlink import CUSTOM_MODE, STANDARD_MODES, Mode, from_imc, moving
from mavlink.missions import first_item
from tasks.transports.mavlink_protocol.errands import go, land, orbit, return_home, steer, take_off
from tasks.transports.mavlink_protocol.helm import Outcome
from tasks.transports.mavlink_protocol.mission import NO_PLAN
from tasks.transports.mavlink_protocol.mission_transfer import number_of
from tasks.transports.mavlink_protocol.orders import DONE, Finish, Order, Reply, Result
from tasks.transports.mavlink_protocol.session import Session

FORCE = 21196
FASTEST = 30.0  # m/s that an order may ask for; the vehicle knows better


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
        case Mode.MANUAL if (system.errand or not moving(system.figures.vehicle)) and not system.aloft:
            if system.errand:
                system.helm.stop(now)
            system.held = False
            reply = DONE
        case _ if mode is before:
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
    system, wish, force = session.autopilot, order.number(1), order.number(2) == FORCE
    if wish not in (0, 1):
        return Reply(Result.DENIED, "Arming denied: parameter 1 is neither 0 nor 1")
    if wish and not system.armed_or_moving and system.obstacle and not force:
        return Reply(Result.DENIED, f"Arming denied: {system.obstacle}")
    if not wish and system.aloft:
        return Reply(Result.DENIED, "Disarming denied: the vehicle is in the air")
    if not wish and moving(system.figures.vehicle):
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
    return take_off(session.autopilot, order.frame, order.params[6], order.finish, now)


def _land(session: Session, order: Order, now: float) -> Reply | None:
    return land(session.autopilot, order.place, order.finish, now)


def _return(session: Session, order: Order, now: float) -> Reply | None:
    return return_home(session.autopilot, order.finish, now)


def _orbit(session: Session, order: Order, now: float) -> Reply | None:
    radius, speed = order.params[0], order.params[1]
    return orbit(session.autopilot, order.place, (order.frame, order.params[6]), radius, speed, order.finish, now)


def _change_speed(session: Session, order: Order, now: float) -> Reply | None:
    """The speed of what ground stations ask for; the speeds of a mission are in its items."""
    system, kind, speed = session.autopilot, order.number(1), order.params[1]
    if kind not in (0, 1):
        return Reply(Result.DENIED, "Speed denied: parameter 1 must be 0 (through air or water) or 1 (over ground)")
    if not 0.0 < speed <= FASTEST:
        return Reply(Result.DENIED, f"Speed denied: {speed:g} m/s is not between 0 and {FASTEST:g} m/s")
    if system.mode is Mode.MISSION:
        return Reply(Result.DENIED, "Speed denied: the speeds of a mission are in its items")
    system.chosen_speed = speed
    return DONE


def _set_home(session: Session, order: Order, now: float) -> Reply:
    """Home is here, or at a place; that of a vessel stays at the surface."""
    system, (lat, lon), altitude = session.autopilot, order.place, order.params[6]
    found = system.place()
    if order.number(1) == 1:
        if found is None:
            return Reply(Result.TEMPORARILY_REJECTED, "The position is unknown")
        lat, lon, altitude = found[1].lat, found[1].lon, found[1].altitude
    home = from_imc.home_at(lat, lon, altitude, afloat=system.kind.afloat, undulation=system.undulation)
    if home is None:
        return Reply(Result.DENIED, "Home denied: it has no latitude, longitude and altitude on earth")
    system.home = home
    session.send_now("HOME_POSITION", now)
    return DONE


def _reboot(session: Session, order: Order, now: float) -> Reply:
    if session.autopilot.armed_or_moving:
        return Reply(Result.DENIED, "Restart denied: the vehicle is armed or moving")
    return Reply(Result.DENIED, "Restart denied: the vehicle's program and computer are not restarted by messages")


COMMANDS: Mapping[int, Callable[[Session, Order, float], Reply | None]] = {
    20: _return,
    21: _land,
    22: _take_off,
    34: _orbit,
    176: _do_set_mode,
    178: _change_speed,
    179: _set_home,
    192: _reposition,
    193: _pause_or_continue,
    224: _set_current,
    246: _reboot,
    262: _do_set_standard_mode,
    300: _mission_start,
    400: _arm,
}
