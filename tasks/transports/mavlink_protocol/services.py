"""Handles the messages of ground stations."""

import math
from collections.abc import Callable, Mapping

from mavlink import Mode, ReceivedMessage, statustext
from mavlink.missions import BadItem, Item, MissionResult
from tasks.transports.mavlink_protocol.commands import obey
from tasks.transports.mavlink_protocol.errands import NO_PLACE, go
from tasks.transports.mavlink_protocol.manual import steer_by_axes, steer_by_channels
from tasks.transports.mavlink_protocol.mission_transfer import acknowledge
from tasks.transports.mavlink_protocol.orders import Order, Reply, Result
from tasks.transports.mavlink_protocol.parameters import DOES_NOT_EXIST, ParameterEntry, Refusal
from tasks.transports.mavlink_protocol.refusals import refuse
from tasks.transports.mavlink_protocol.session import Session
from tasks.transports.mavlink_protocol.steering import COMMANDS as STEERING
from tasks.transports.mavlink_protocol.steering import set_mode
from tasks.transports.mavlink_protocol.streams import STREAMS

ITEMS = ("MISSION_ITEM", "MISSION_ITEM_INT")
ARM = 400  # MAV_CMD_COMPONENT_ARM_DISARM
GUIDED, ALTITUDE_ONLY = 2, 3  # field current of an item that is an order


def serve(session: Session, message: ReceivedMessage, now: float) -> None:
    """Answer a message that is addressed to the vehicle; ignore it if it needs no answer."""
    if refuse(session, message, now):
        return
    service = SERVICES.get(message.name) or session.autopilot.transfer.services.get(message.name)
    if message.name in ITEMS and message.values["current"] in (GUIDED, ALTITUDE_ONLY):
        _go(session, message, now)
    elif service is not None:
        service(session, message, now)


def _go(session: Session, message: ReceivedMessage, now: float) -> None:
    """Go to an item, or only to its altitude: Mission Planner and MAVProxy send a vehicle in this way."""

    def finish(reply: Reply) -> None:
        done = reply.result is Result.ACCEPTED
        acknowledge(session, message, MissionResult.ACCEPTED if done else MissionResult.ERROR)
        if reply.reason:
            session.say(statustext.WARNING, reply.reason, now)

    try:
        item = (Item.of_legacy if message.name == "MISSION_ITEM" else Item.of)(message.values)
    except BadItem as bad:
        finish(Reply(Result.DENIED, str(bad)))
        return
    session.autopilot.orders += 1
    place = math.radians(item.x * 1e-7), math.radians(item.y * 1e-7)
    moves = message.values["current"] == GUIDED
    reply = go(session.autopilot, place if moves else NO_PLACE, item.frame, item.z, -1.0, finish, now)
    if reply is not None:
        finish(reply)


def _ping(session: Session, message: ReceivedMessage, now: float) -> None:
    if message.values["target_system"] == 0:
        session.answer(message, "PING", time_usec=message.values["time_usec"], seq=message.values["seq"])


def _timesync(session: Session, message: ReceivedMessage, now: float) -> None:
    if message.values["tc1"] == 0:
        session.answer(message, "TIMESYNC", tc1=round(now * 1e9), ts1=message.values["ts1"])


def _set_mode(session: Session, message: ReceivedMessage, now: float) -> None:
    def finish(reply: Reply) -> None:
        if reply.result is not Result.ACCEPTED:
            session.say(statustext.WARNING, reply.reason, now)

    session.autopilot.orders += 1
    number = message.values["custom_mode"]
    reply = set_mode(session, session.flavour.mode(session.autopilot.kind, number), number, finish, now)
    if reply is not None:
        finish(reply)


def _request_data_stream(session: Session, message: ReceivedMessage, now: float) -> None:
    values = message.values
    group, rate = values["req_stream_id"], values["req_message_rate"] if values["start_stop"] else 0
    for name, stream in STREAMS.items():
        if stream.group and group in (0, stream.group):
            session.set_period(name, 1.0 / rate if rate else 0.0)


def _parameter_list(session: Session, message: ReceivedMessage, now: float) -> None:
    session.list_parameters(now)


def _read_parameter(session: Session, message: ReceivedMessage, now: float) -> None:
    index, name = message.values["param_index"], message.values["param_id"]
    table = session.autopilot.parameters
    entry = table.named(name) if index == -1 else table.at(index)
    if entry is not None:
        session.send_parameter(entry)
    else:
        session.answer(message, "PARAM_ERROR", param_id=name, param_index=index, error=DOES_NOT_EXIST)


def _set_parameter(session: Session, message: ReceivedMessage, now: float) -> None:
    name = message.values["param_id"]
    entry = session.autopilot.parameters.named(name)
    if entry is None:
        session.answer(message, "PARAM_ERROR", param_id=name, param_index=-1, error=DOES_NOT_EXIST)
        return
    try:
        wanted = entry.text(message.payload[:4], message.values["param_type"], session.flavour)
    except Refusal as refusal:
        session.answer(message, "PARAM_ERROR", param_id=name, param_index=entry.index, error=refusal.code)
        session.send_parameter(entry)
        session.say(statustext.WARNING, f"{_plain(entry)}: {refusal}", now)
        return
    session.autopilot.set_parameter(entry, wanted)


def _plain(entry: ParameterEntry) -> str:
    return f"{entry.task.entity.label}, {entry.parameter.name}"


def _manual_control(session: Session, message: ReceivedMessage, now: float) -> None:
    """The axes steer; the buttons do what the profile says, in each mode."""
    system, values = session.autopilot, message.values
    if values["target"] not in (0, system.system):
        return
    steer_by_axes(session, message, now)

    def act(action: str) -> None:
        def finish(reply: Reply) -> None:
            if reply.reason:
                session.say(statustext.WARNING, reply.reason, now)

        system.orders += 1
        if action == "abort":
            system.abort(now)
            return
        order = Order(ARM, (0.0,) * 7, None, finish)
        reply = (
            STEERING[ARM](session, order, now)
            if action == "disarm"
            else set_mode(session, Mode[action.upper()], -1, finish, now)
        )
        if reply is not None:
            finish(reply)

    pressed = values["buttons"] | values["buttons2"] << 16
    system.switches.press((id(session), message.system, message.component), pressed, now, act)


def _target(session: Session, message: ReceivedMessage, now: float) -> None:
    session.autopilot.target.hear(session, message, now)


def _transfer(session: Session, message: ReceivedMessage, now: float) -> None:
    session.autopilot.transfers.hear(session, message, now)


def _erase_logs(session: Session, message: ReceivedMessage, now: float) -> None:
    session.say(statustext.WARNING, "Logs are not erased by ground stations", now)


SERVICES: Mapping[str, Callable[[Session, ReceivedMessage, float], None]] = {
    "PING": _ping,
    "TIMESYNC": _timesync,
    "COMMAND_LONG": obey,
    "COMMAND_INT": obey,
    "SET_MODE": _set_mode,
    "REQUEST_DATA_STREAM": _request_data_stream,
    "PARAM_REQUEST_LIST": _parameter_list,
    "PARAM_REQUEST_READ": _read_parameter,
    "PARAM_SET": _set_parameter,
    "SET_POSITION_TARGET_GLOBAL_INT": _target,
    "SET_POSITION_TARGET_LOCAL_NED": _target,
    "SET_ATTITUDE_TARGET": _target,
    "MANUAL_CONTROL": _manual_control,
    "RC_CHANNELS_OVERRIDE": steer_by_channels,
    "FILE_TRANSFER_PROTOCOL": _transfer,
    "LOG_REQUEST_LIST": _transfer,
    "LOG_REQUEST_DATA": _transfer,
    "LOG_REQUEST_END": _transfer,
    "LOG_ERASE": _erase_logs,
}
