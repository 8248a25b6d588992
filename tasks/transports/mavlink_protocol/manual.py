"""Steering by hand: axes of a ground station as RemoteActions, while it has chosen to steer."""

import math
from typing import TYPE_CHECKING

import imc
from mavlink import Mode, ReceivedMessage, statustext

if TYPE_CHECKING:
    from tasks.transports.mavlink_protocol.session import Session

FULL = 1000.0  # full deflection of MANUAL_CONTROL
PITCH = 1  # of enabled_extensions: the axis s is valid
UNUSED = 0x7FFF
MIDDLE, SPAN = 1500.0, 400.0  # µs of RC_CHANNELS_OVERRIDE
RELEASED = (0, 0xFFFF)
RANGE = 127  # of RemoteActions
STRANGER = "Another ground station steers"


def steer_by_axes(session: "Session", message: ReceivedMessage, now: float) -> None:
    """MANUAL_CONTROL: x is thrust; r turns, of boats also y; z around 500, or s, is the pitch of an AUV."""
    values = message.values
    x, y, r = (_share(values[name] / FULL) if values[name] != UNUSED else 0.0 for name in "xyr")
    pitch = _share((values["z"] - FULL / 2.0) / (FULL / 2.0)) if values["z"] != UNUSED else 0.0
    if values["enabled_extensions"] & PITCH:
        pitch = _share(values["s"] / FULL)
    turn = r if r or session.autopilot.dives else y
    _send(session, message, thrust=x, turn=turn, pitch=pitch, now=now)


def steer_by_channels(session: "Session", message: ReceivedMessage, now: float) -> None:
    """RC_CHANNELS_OVERRIDE as ArduSub and ArduRover read it: 5 thrust, 4 turn, 3 pitch; of boats 3 thrust, 1 turn."""

    def channel(number: int) -> float:
        value = message.values[f"chan{number}_raw"]
        return 0.0 if value in RELEASED else _share((value - MIDDLE) / SPAN)

    if session.autopilot.dives:
        _send(session, message, thrust=channel(5), turn=channel(4), pitch=channel(3), now=now)
    else:
        _send(session, message, thrust=channel(3), turn=channel(1), pitch=0.0, now=now)


def _send(
    session: "Session", message: ReceivedMessage, *, thrust: float, turn: float, pitch: float, now: float
) -> None:
    system = session.autopilot
    if system.mode is not Mode.TELEOPERATION or system.errand != "steered":
        return
    steersman = id(session), message.system, message.component
    if not system.steered_by(steersman, now):
        session.say(statustext.WARNING, STRANGER, now)
        return
    axes = {"Heading": turn, "Thrust": thrust} | ({"Pitch": pitch} if system.dives else {})
    actions = ";".join(f"{name}={round(share * RANGE)}" for name, share in axes.items())
    system.publish(imc.RemoteActions(actions=actions, dst=system.imc_id))


def _share(value: float) -> float:
    return max(-1.0, min(1.0, value)) if math.isfinite(value) else 0.0
