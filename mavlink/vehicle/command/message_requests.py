"""Orders that ask for messages, once or at a rate."""

import math
from collections.abc import Callable, Mapping

from mavlink import VehicleKind, statustext
from mavlink.vehicle.command.request import DONE, CommandRequest, CommandResult, MavResult
from mavlink.vehicle.session import HEARTBEAT_PERIOD, Session

MESSAGE_INTERVAL = 244


def _offered(session: Session, number: int | None) -> str:
    definition = session.source.dialect.by_id.get(-1 if number is None else number)
    return definition.name if definition is not None and session.source.offers(definition.name) else ""


def _request_message(session: Session, order: CommandRequest, now: float) -> CommandResult:
    if order.integer_parameter(1) == MESSAGE_INTERVAL:
        return _get_message_interval(session, order.integer_parameter(2))
    name = _offered(session, order.integer_parameter(1))
    return _send(session, name, now, order.integer_parameter(2) or 0) if name else CommandResult(MavResult.UNSUPPORTED)


def _request(name: str) -> Callable[[Session, CommandRequest, float], CommandResult]:
    return lambda session, order, now: _send(session, name, now)


def _send(session: Session, name: str, now: float, number: int = 0) -> CommandResult:
    if session.build_and_send(name, now, number):
        return DONE
    return CommandResult(MavResult.TEMPORARILY_REJECTED, f"{name} is not available yet")


def _set_message_interval(session: Session, order: CommandRequest, now: float) -> CommandResult:
    name, interval = _offered(session, order.integer_parameter(1)), order.params[1]
    if not name:
        return CommandResult(MavResult.DENIED, f"Message {order.params[0]:g} is not offered")
    if not math.isfinite(interval) or (interval < 0.0 and interval != -1.0):
        return CommandResult(MavResult.DENIED, f"{interval:g} is not a valid interval")
    if name == "HEARTBEAT":
        kept = interval in (0.0, HEARTBEAT_PERIOD * 1e6)
        return DONE if kept else CommandResult(MavResult.DENIED, "HEARTBEAT stays at 1 Hz")
    session.set_period(name, None if interval == 0.0 else max(0.0, interval * 1e-6))
    return DONE


def _get_message_interval(session: Session, number: int | None) -> CommandResult:
    """Send MESSAGE_INTERVAL of a message: -1 if it is not streamed, 0 if it is not offered."""
    name = _offered(session, number)
    period = session.period(name) if name else math.nan
    interval = 0 if not name else round(period * 1e6) if period else -1
    session.send("MESSAGE_INTERVAL", {"message_id": number or 0, "interval_us": interval})
    return DONE


COMMANDS: Mapping[int, Callable[[Session, CommandRequest, float], CommandResult]] = {
    410: _request("HOME_POSITION"),
    510: lambda session, order, now: _get_message_interval(session, order.integer_parameter(1)),
    511: _set_message_interval,
    512: _request_message,
    519: _request("PROTOCOL_VERSION"),
    520: _request("AUTOPILOT_VERSION"),
}


LEGACY_REQUESTS: Mapping[int, str] = {
    521: "CAMERA_INFORMATION",
    522: "CAMERA_SETTINGS",
    525: "STORAGE_INFORMATION",
    527: "CAMERA_CAPTURE_STATUS",
    2504: "VIDEO_STREAM_INFORMATION",
    2505: "VIDEO_STREAM_STATUS",
}
"""Older requests to cameras, for one message each."""
SEND_BANNER = 42428
READING = frozenset((*COMMANDS, *LEGACY_REQUESTS, SEND_BANNER))
"""Commands that change nothing but what their sender gets."""


def make_banner_handler(kind: VehicleKind) -> Callable[[Session, CommandRequest, float], CommandResult]:
    """MAV_CMD_DO_SEND_BANNER of a kind of vehicle: the name and version of the firmware as a text."""

    def send_banner(session: Session, order: CommandRequest, now: float) -> CommandResult:
        session.send_statustext(statustext.INFO, session.flavor.banner(kind), now)
        return DONE

    return send_banner
