"""Handles the messages of ground stations."""

import struct
from collections.abc import Callable, Mapping

from mavlink import Received, text
from tasks.transports.mavlink_protocol.commands import Result, obey, set_mode
from tasks.transports.mavlink_protocol.parameters import DOES_NOT_EXIST, ParameterEntry, Refusal
from tasks.transports.mavlink_protocol.session import Session

MISSION_ACCEPTED, MISSION_UNSUPPORTED, MISSION_INVALID_SEQUENCE = 0, 3, 13
FTP_LAYOUT = struct.Struct("<HBBBBBxI")
FTP_ACK, FTP_NAK = 128, 129
FTP_ENDING, FTP_ASKING = (1, 2), (3, 4, 14, 15)  # terminate, reset; list, open, checksum, burst read
FTP_UNKNOWN_COMMAND, FTP_NOT_FOUND = 7, 10

# messages by group of the older REQUEST_DATA_STREAM; group 0 is all of them
STREAMS: Mapping[int, tuple[str, ...]] = {
    2: ("SYS_STATUS", "SYSTEM_TIME"),
    6: ("GLOBAL_POSITION_INT", "LOCAL_POSITION_NED"),
    10: ("ATTITUDE",),
    11: ("VFR_HUD",),
    12: ("HOME_POSITION", "EXTENDED_SYS_STATE"),
}


def serve(session: Session, message: Received, now: float) -> None:
    """Answer a message that is addressed to the vehicle; ignore it if it needs no answer."""
    service = SERVICES.get(message.name)
    if service is not None:
        service(session, message, now)


def _ping(session: Session, message: Received, now: float) -> None:
    if message.values["target_system"] == 0:
        session.answer("PING", time_usec=message.values["time_usec"], seq=message.values["seq"])


def _timesync(session: Session, message: Received, now: float) -> None:
    if message.values["tc1"] == 0:
        session.answer("TIMESYNC", tc1=round(now * 1e9), ts1=message.values["ts1"])


def _set_mode(session: Session, message: Received, now: float) -> None:
    autopilot = session.autopilot
    result, reason = set_mode(session, session.flavour.mode(autopilot.kind, message.values["custom_mode"]), now)
    if result is not Result.ACCEPTED:
        session.say(text.WARNING, reason, now)


def _request_data_stream(session: Session, message: Received, now: float) -> None:
    values = message.values
    group, rate = values["req_stream_id"], values["req_message_rate"] if values["start_stop"] else 0
    names = STREAMS.get(group, ()) if group else (name for names in STREAMS.values() for name in names)
    for name in names:
        session.set_period(name, 1.0 / rate if rate else 0.0)


def _parameter_list(session: Session, message: Received, now: float) -> None:
    session.list_parameters(now)


def _read_parameter(session: Session, message: Received, now: float) -> None:
    index, name = message.values["param_index"], message.values["param_id"]
    table = session.autopilot.parameters
    entry = table.named(name) if index == -1 else table.at(index)
    if entry is not None:
        session.send_parameter(entry)
    else:
        session.answer("PARAM_ERROR", param_id=name, param_index=index, error=DOES_NOT_EXIST)


def _set_parameter(session: Session, message: Received, now: float) -> None:
    name = message.values["param_id"]
    entry = session.autopilot.parameters.named(name)
    if entry is None:
        session.answer("PARAM_ERROR", param_id=name, param_index=-1, error=DOES_NOT_EXIST)
        return
    try:
        wanted = entry.text(message.payload[:4], message.values["param_type"], session.flavour)
    except Refusal as refusal:
        session.answer("PARAM_ERROR", param_id=name, param_index=entry.index, error=refusal.code)
        session.send_parameter(entry)
        session.say(text.WARNING, f"{_plain(entry)}: {refusal}", now)
        return
    session.autopilot.set_parameter(entry, wanted)


def _plain(entry: ParameterEntry) -> str:
    return f"{entry.task.entity.label}, {entry.parameter.name}"


def _mission_list(session: Session, message: Received, now: float) -> None:
    session.answer("MISSION_COUNT", count=0, mission_type=message.values["mission_type"])


def _mission_item(session: Session, message: Received, now: float) -> None:
    _acknowledge(session, message, MISSION_INVALID_SEQUENCE)


def _mission_upload(session: Session, message: Received, now: float) -> None:
    empty = message.name == "MISSION_COUNT" and message.values["count"] == 0
    _acknowledge(session, message, MISSION_ACCEPTED if empty else MISSION_UNSUPPORTED)
    if not empty:
        session.say(text.WARNING, "Missions over MAVLink are not supported", now)


def _mission_clear(session: Session, message: Received, now: float) -> None:
    _acknowledge(session, message, MISSION_ACCEPTED)


def _acknowledge(session: Session, message: Received, kind: int) -> None:
    session.answer("MISSION_ACK", type=kind, mission_type=message.values["mission_type"])


def _file_transfer(session: Session, message: Received, now: float) -> None:
    """Refuse all files: an immediate answer saves clients their timeout."""
    sequence, number, opcode, _, _, _, offset = FTP_LAYOUT.unpack_from(bytes(message.values["payload"]))
    if opcode in (FTP_ACK, FTP_NAK):
        return
    sequence = (sequence + 1) & 0xFFFF
    if opcode in FTP_ENDING:
        payload = FTP_LAYOUT.pack(sequence, number, FTP_ACK, 0, opcode, 0, offset)
    else:
        error = FTP_NOT_FOUND if opcode in FTP_ASKING else FTP_UNKNOWN_COMMAND
        payload = FTP_LAYOUT.pack(sequence, number, FTP_NAK, 1, opcode, 0, offset) + bytes((error,))
    session.answer("FILE_TRANSFER_PROTOCOL", payload=tuple(payload))


SERVICES: Mapping[str, Callable[[Session, Received, float], None]] = {
    "PING": _ping,
    "TIMESYNC": _timesync,
    "COMMAND_LONG": obey,
    "COMMAND_INT": obey,
    "SET_MODE": _set_mode,
    "REQUEST_DATA_STREAM": _request_data_stream,
    "PARAM_REQUEST_LIST": _parameter_list,
    "PARAM_REQUEST_READ": _read_parameter,
    "PARAM_SET": _set_parameter,
    "MISSION_REQUEST_LIST": _mission_list,
    "MISSION_REQUEST": _mission_item,
    "MISSION_REQUEST_INT": _mission_item,
    "MISSION_COUNT": _mission_upload,
    "MISSION_WRITE_PARTIAL_LIST": _mission_upload,
    "MISSION_CLEAR_ALL": _mission_clear,
    "FILE_TRANSFER_PROTOCOL": _file_transfer,
}
