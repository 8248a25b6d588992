"""Orders that ask for messages, once or at a rate."""

import math
from collections.abc import Callable, Mapping

from mavlink import statustext
from tasks.transports.mavlink_protocol.orders import DONE, Order, Reply, Result
from tasks.transports.mavlink_protocol.session import HEARTBEAT_PERIOD, Session

MESSAGE_INTERVAL = 244


def send_banner(session: Session, now: float) -> None:
    session.say(statustext.INFO, session.flavour.banner(session.autopilot.kind), now)


def _offered(session: Session, number: int | None) -> str:
    definition = session.autopilot.dialect.by_id.get(-1 if number is None else number)
    return definition.name if definition is not None and definition.name in session.streams else ""


def _request_message(session: Session, order: Order, now: float) -> Reply:
    if order.number(1) == MESSAGE_INTERVAL:
        return _get_message_interval(session, order.number(2))
    name = _offered(session, order.number(1))
    return _send(session, name, now, order.number(2) or 0) if name else Reply(Result.UNSUPPORTED)


def _request(name: str) -> Callable[[Session, Order, float], Reply]:
    return lambda session, order, now: _send(session, name, now)


def _send(session: Session, name: str, now: float, number: int = 0) -> Reply:
    if session.send_now(name, now, number):
        return DONE
    return Reply(Result.TEMPORARILY_REJECTED, f"{name} is not available yet")


def _set_message_interval(session: Session, order: Order, now: float) -> Reply:
    name, interval = _offered(session, order.number(1)), order.params[1]
    if not name:
        return Reply(Result.DENIED, f"Message {order.params[0]:g} is not offered")
    if not math.isfinite(interval) or (interval < 0.0 and interval != -1.0):
        return Reply(Result.DENIED, f"{interval:g} is not a valid interval")
    if name == "HEARTBEAT":
        kept = interval in (0.0, HEARTBEAT_PERIOD * 1e6)
        return DONE if kept else Reply(Result.DENIED, "HEARTBEAT stays at 1 Hz")
    session.set_period(name, None if interval == 0.0 else max(0.0, interval * 1e-6))
    return DONE


def _get_message_interval(session: Session, number: int | None) -> Reply:
    """Send MESSAGE_INTERVAL of a message: -1 if it is not streamed, 0 if it is not offered."""
    name = _offered(session, number)
    period = session.period(name) if name else math.nan
    interval = 0 if not name else round(period * 1e6) if period else -1
    session.send("MESSAGE_INTERVAL", {"message_id": number or 0, "interval_us": interval})
    return DONE


def _banner(session: Session, order: Order, now: float) -> Reply:
    send_banner(session, now)
    return DONE


COMMANDS: Mapping[int, Callable[[Session, Order, float], Reply]] = {
    410: _request("HOME_POSITION"),
    510: lambda session, order, now: _get_message_interval(session, order.number(1)),
    511: _set_message_interval,
    512: _request_message,
    519: _request("PROTOCOL_VERSION"),
    520: _request("AUTOPILOT_VERSION"),
    42428: _banner,
}
