"""What a vehicle that takes no orders answers to them, with the reason."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from mavlink import ReceivedMessage, statustext
from mavlink.missions import MissionResult
from tasks.transports.mavlink_protocol.mission_transfer import acknowledge

if TYPE_CHECKING:
    from tasks.transports.mavlink_protocol.session import Session

Refuse = Callable[["Session", ReceivedMessage], object]


def refuse(session: "Session", message: ReceivedMessage, now: float) -> bool:
    """Whether a message is an order that is refused now; orders by COMMAND_LONG and COMMAND_INT are none here."""
    reason, answer = session.autopilot.refusal, REFUSED.get(message.name)
    if not reason or (answer is None and message.name not in STEERING):
        return False
    if answer is None:
        return True  # a stick is sent many times a second: the refused mode was told
    answer(session, message)
    session.say(statustext.WARNING, reason, now)
    return True


def _deny(session: "Session", message: ReceivedMessage) -> None:
    acknowledge(session, message, MissionResult.DENIED)


def _only_tell(session: "Session", message: ReceivedMessage) -> None:
    pass  # these have no answer but a text


STEERING = frozenset(("MANUAL_CONTROL", "RC_CHANNELS_OVERRIDE"))
REFUSED: Mapping[str, Refuse] = {
    **dict.fromkeys(("MISSION_COUNT", "MISSION_WRITE_PARTIAL_LIST", "MISSION_CLEAR_ALL"), _deny),
    **dict.fromkeys(("SET_MODE", "MISSION_SET_CURRENT", "SET_ATTITUDE_TARGET"), _only_tell),
    **dict.fromkeys(("SET_POSITION_TARGET_GLOBAL_INT", "SET_POSITION_TARGET_LOCAL_NED"), _only_tell),
}
