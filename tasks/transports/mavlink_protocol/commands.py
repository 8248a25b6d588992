"""MAV_CMD: the commands that ground stations may send, and the answer to all others."""

import math
from collections.abc import Callable, Mapping
from enum import IntEnum
from typing import NamedTuple

from mavlink import CUSTOM_MODE, STANDARD_MODES, Mode, Received, moving, text
from tasks.transports.mavlink_protocol.session import HEARTBEAT_PERIOD, Session

FORCE = 21196
UNKNOWN_32 = (-(1 << 31), (1 << 31) - 1)


class Result(IntEnum):
    """MAV_RESULT."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3


class Order(NamedTuple):
    """A command and its seven parameters; NaN: not given."""

    command: int
    params: tuple[float, ...]

    def number(self, index: int) -> int | None:
        """A parameter, counted from 1, as an integer; None if it is not one."""
        value = self.params[index - 1]
        return int(value) if math.isfinite(value) and value == int(value) else None


Reply = tuple[Result, str]
DONE: Reply = (Result.ACCEPTED, "")


def obey(session: Session, message: Received, now: float) -> None:
    """Carry out COMMAND_LONG or COMMAND_INT, acknowledge it, and send the reason if it is refused."""
    values = message.values
    names = ("x", "y", "z") if message.name == "COMMAND_INT" else ("param5", "param6", "param7")
    params = [float(values[name]) for name in ("param1", "param2", "param3", "param4", *names)]
    if message.name == "COMMAND_INT":
        params[4:6] = [math.nan if value in UNKNOWN_32 else value for value in params[4:6]]
    order = Order(values["command"], tuple(params))
    result, reason = COMMANDS.get(order.command, _unsupported)(session, order, now)
    session.answer("COMMAND_ACK", command=order.command, result=result)
    if reason:
        session.say(text.WARNING, reason, now)


def set_mode(session: Session, mode: Mode, now: float) -> Reply:
    """Set a mode if possible: HOLD always is, and so is the present mode; MANUAL ends a hold."""
    autopilot = session.autopilot
    if mode is Mode.HOLD:
        autopilot.hold(now)
        return DONE
    free = autopilot.holds_station or not moving(autopilot.figures.vehicle)
    if mode is Mode.MANUAL and free and not autopilot.aloft:
        if autopilot.holds_station:
            autopilot.stop_plan()
        autopilot.held = False
        return DONE
    if mode is autopilot.mode:
        return DONE
    return Result.DENIED, f"Mode {mode.name} denied: ground stations can only choose MANUAL and HOLD here"


def send_banner(session: Session, now: float) -> None:
    session.say(text.INFO, session.flavour.banner(session.autopilot.kind), now)


def _unsupported(session: Session, order: Order, now: float) -> Reply:
    return Result.UNSUPPORTED, ""


def _arm(session: Session, order: Order, now: float) -> Reply:
    autopilot, wish, force = session.autopilot, order.number(1), order.number(2) == FORCE
    if wish not in (0, 1):
        return Result.DENIED, "Arming denied: parameter 1 is neither 0 nor 1"
    if wish and not autopilot.armed_or_moving and autopilot.obstacle and not force:
        return Result.DENIED, f"Arming denied: {autopilot.obstacle}"
    if not wish and autopilot.aloft:
        return Result.DENIED, "Disarming denied: the vehicle is in the air"
    if not wish and moving(autopilot.figures.vehicle):
        if not force and not autopilot.holds_station:
            return Result.DENIED, "Disarming denied: the vehicle is executing a maneuver"
        autopilot.stop_plan()
    autopilot.armed = bool(wish)
    return DONE


def _do_set_mode(session: Session, order: Order, now: float) -> Reply:
    base, main, sub = order.number(1), order.number(2), order.number(3) or 0
    if base is None or not base & CUSTOM_MODE or main is None or main < 0 or not 0 <= sub < 256:
        return Result.DENIED, "Mode denied: only custom modes are supported"
    return set_mode(session, session.flavour.commanded_mode(session.autopilot.kind, main, sub), now)


def _do_set_standard_mode(session: Session, order: Order, now: float) -> Reply:
    return set_mode(session, STANDARD_MODES.get(order.number(1) or 0, Mode.OTHER), now)


def _offered(session: Session, number: int | None) -> str:
    definition = session.autopilot.dialect.by_id.get(-1 if number is None else number)
    return definition.name if definition is not None and session.autopilot.offers(definition.name) else ""


def _request_message(session: Session, order: Order, now: float) -> Reply:
    name = _offered(session, order.number(1))
    return _send(session, name, now) if name else (Result.UNSUPPORTED, "")


def _request(name: str) -> Callable[[Session, Order, float], Reply]:
    return lambda session, order, now: _send(session, name, now)


def _send(session: Session, name: str, now: float) -> Reply:
    return DONE if session.send_now(name, now) else (Result.TEMPORARILY_REJECTED, f"{name} is not available yet")


def _set_message_interval(session: Session, order: Order, now: float) -> Reply:
    name, interval = _offered(session, order.number(1)), order.params[1]
    if not name:
        return Result.DENIED, f"Message {order.params[0]:g} is not offered"
    if not math.isfinite(interval) or (interval < 0.0 and interval != -1.0):
        return Result.DENIED, f"{interval:g} is not a valid interval"
    if name == "HEARTBEAT":
        kept = interval in (0.0, HEARTBEAT_PERIOD * 1e6)
        return DONE if kept else (Result.DENIED, "HEARTBEAT stays at 1 Hz")
    session.set_period(name, None if interval == 0.0 else max(0.0, interval * 1e-6))
    return DONE


def _get_message_interval(session: Session, order: Order, now: float) -> Reply:
    number = order.number(1)
    name = _offered(session, number)
    period = session.period(name) if name else math.nan
    interval = 0 if not name else round(period * 1e6) if period else -1
    session.send("MESSAGE_INTERVAL", {"message_id": number or 0, "interval_us": interval})
    return DONE


def _banner(session: Session, order: Order, now: float) -> Reply:
    send_banner(session, now)
    return DONE


COMMANDS: Mapping[int, Callable[[Session, Order, float], Reply]] = {
    176: _do_set_mode,
    262: _do_set_standard_mode,
    400: _arm,
    410: _request("HOME_POSITION"),
    510: _get_message_interval,
    511: _set_message_interval,
    512: _request_message,
    520: _request("AUTOPILOT_VERSION"),
    42428: _banner,
}
