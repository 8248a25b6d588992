"""Answers of a vehicle that takes no orders, with the reason."""

from collections.abc import Callable, Mapping

from mavlink import ReceivedMessage, statustext
from mavlink.missions import MissionResult
from mavlink.vehicle.command.message_requests import READING
from mavlink.vehicle.mission import acknowledge
from mavlink.vehicle.session import Session


def refuse_if_read_only(session: Session, message: ReceivedMessage, reason: str, now: float) -> bool:
    """Whether a message is an order that is rejected now; orders by COMMAND_LONG and COMMAND_INT are none here."""
    answer = REFUSED.get(message.name)
    if not reason or (answer is None and message.name not in STEERING):
        return False
    if answer is None:
        return True  # a stick is sent many times a second: the refused mode was reported
    answer(session, message)
    session.send_statustext(statustext.WARNING, reason, now)
    return True


def is_order(message: ReceivedMessage) -> bool:
    """Whether a message asks for more than to be read to, be it obeyed or not."""
    if message.name in COMMANDS:
        return message.values["command"] not in READING
    return message.name in REFUSED or message.name in STEERING or message.name in SETTINGS


def _deny(session: Session, message: ReceivedMessage) -> None:
    acknowledge(session, message, MissionResult.DENIED)


def _only_text(session: Session, message: ReceivedMessage) -> None:
    pass  # these have no answer but a text


COMMANDS = frozenset(("COMMAND_LONG", "COMMAND_INT"))
SETTINGS = frozenset(("PARAM_SET", "PARAM_EXT_SET"))
STEERING = frozenset(("MANUAL_CONTROL", "RC_CHANNELS_OVERRIDE"))
REFUSED: Mapping[str, Callable[[Session, ReceivedMessage], object]] = {
    **dict.fromkeys(("MISSION_COUNT", "MISSION_WRITE_PARTIAL_LIST", "MISSION_CLEAR_ALL"), _deny),
    **dict.fromkeys(("MISSION_ITEM", "MISSION_ITEM_INT"), _deny),
    **dict.fromkeys(("SET_MODE", "MISSION_SET_CURRENT", "SET_ATTITUDE_TARGET"), _only_text),
    **dict.fromkeys(("SET_POSITION_TARGET_GLOBAL_INT", "SET_POSITION_TARGET_LOCAL_NED"), _only_text),
}
