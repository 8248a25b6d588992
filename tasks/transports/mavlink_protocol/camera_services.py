"""Handles what ground stations say to a camera."""

import math
from collections.abc import Callable, Mapping
from functools import partial

from mavlink import ReceivedMessage, statustext
from tasks.transports.mavlink_protocol import inquiries
from tasks.transports.mavlink_protocol.cameras import Camera
from tasks.transports.mavlink_protocol.commands import obey
from tasks.transports.mavlink_protocol.orders import DONE, Order, Reply, Result
from tasks.transports.mavlink_protocol.session import Session, addressed
from tasks.transports.mavlink_protocol.settings import Setting
from tasks.transports.mavlink_protocol.streams import STREAMS

CAPTURED = 263
REFUSED = 1  # PARAM_ACK_VALUE_UNSUPPORTED
ORDERS = ("COMMAND_LONG", "COMMAND_INT")
REQUEST_MESSAGE = 512
FILES = "FILE_TRANSFER_PROTOCOL"
UNSUPPORTED = Reply(Result.UNSUPPORTED)


def hearers(session: Session, message: ReceivedMessage) -> list[Session]:
    """The components that a message is for; an order to all is only for those who know it, a file for the first."""
    found = [p for p in (session, *session.cameras) if addressed(message, session.autopilot.system, p.component)]
    if message.name == FILES:
        return found[:1]
    if message.name not in ORDERS or len(found) < 2:
        return found
    return [part for part in found[1:] if _knows(part, message)] or found[:1]


def serve_camera(session: Session, message: ReceivedMessage, now: float) -> None:
    """Answer a message to the camera of a session; ignore it if it needs no answer."""
    service, camera = SERVICES.get(message.name), session.camera
    if service is not None and camera is not None:
        service(session, camera, message, now)


def show_picture(session: Session, index: int) -> bool:
    """Send CAMERA_IMAGE_CAPTURED; False if there is no such picture."""
    camera = session.camera
    fields = camera.captured(index, session.autopilot.boot) if camera is not None else None
    if fields is not None:
        session.send("CAMERA_IMAGE_CAPTURED", fields)
    return fields is not None


def show_setting(session: Session, setting: Setting) -> None:
    """Send PARAM_EXT_VALUE."""
    assert session.camera is not None
    session.send(
        "PARAM_EXT_VALUE",
        {
            "param_id": setting.id.encode(),
            "param_value": setting.encoded,
            "param_type": setting.type,
            "param_index": setting.index,
            "param_count": len(session.camera.settings),
        },
    )


def acknowledge_setting(session: Session, setting: Setting, result: int) -> None:
    """Send PARAM_EXT_ACK with the present value."""
    fields = {"param_id": setting.id.encode(), "param_value": setting.encoded, "param_type": setting.type}
    session.send("PARAM_EXT_ACK", {**fields, "param_result": result})


def _knows(session: Session, message: ReceivedMessage) -> bool:
    """Whether an order that all get is meant for a camera."""
    command, first = message.values["command"], message.values["param1"]
    if command != REQUEST_MESSAGE:
        return command in CAMERA_COMMANDS
    definition = session.autopilot.dialect.by_id.get(int(first)) if math.isfinite(first) else None
    return definition is not None and definition.name in session.streams and definition.name not in STREAMS


def _order(session: Session, camera: Camera, message: ReceivedMessage, now: float) -> None:
    obey(session, message, now, COMMANDS)


def _file(session: Session, camera: Camera, message: ReceivedMessage, now: float) -> None:
    """The vehicle's files: MAVSDK asks the camera itself for its definition."""
    session.autopilot.transfers.hear(session, message, now)


def _list(session: Session, camera: Camera, message: ReceivedMessage, now: float) -> None:
    session.send_all([partial(show_setting, session, setting) for setting in camera.settings], now)


def _read(session: Session, camera: Camera, message: ReceivedMessage, now: float) -> None:
    index, name = message.values["param_index"], message.values["param_id"]
    setting = camera.settings.named(name) if index == -1 else camera.settings.at(index)
    if setting is not None:
        show_setting(session, setting)


def _set(session: Session, camera: Camera, message: ReceivedMessage, now: float) -> None:
    values = message.values
    setting = camera.settings.named(values["param_id"])
    if setting is None:
        fields = {name: values[name] for name in ("param_id", "param_value", "param_type")}
        session.send("PARAM_EXT_ACK", {**fields, "param_result": REFUSED})
        return
    try:
        wanted = setting.wanted(_raw_value(message), values["param_type"])
    except ValueError as error:
        acknowledge_setting(session, setting, REFUSED)
        session.say(statustext.WARNING, f"{camera.label}, {setting.parameter.name}: {error}", now)
        return
    camera.change(setting, wanted, session, now)


def _raw_value(message: ReceivedMessage) -> bytes:
    """The value in PARAM_EXT_SET, with the zeros in it."""
    start = 2 + 16  # target and name
    return message.payload[start : start + 128]


def _request_message(session: Session, order: Order, now: float) -> Reply:
    if order.number(1) != CAPTURED or math.isnan(order.params[1]):
        return inquiries.COMMANDS[REQUEST_MESSAGE](session, order, now)
    index = order.number(2)
    if index is None or not show_picture(session, index):
        return Reply(Result.DENIED, f"There is no picture {order.params[1]:g}")
    return DONE


def _legacy(name: str) -> Callable[[Session, Order, float], Reply]:
    """The older request for a message."""

    def request(session: Session, order: Order, now: float) -> Reply:
        return DONE if name in session.streams and session.send_now(name, now) else UNSUPPORTED

    return request


def _start_capture(session: Session, order: Order, now: float) -> Reply:
    camera, count, interval = session.camera, order.number(3), order.params[1]
    if camera is None or not camera.takes_pictures:
        return UNSUPPORTED
    if count is None or count < 0 or (count != 1 and not 0.0 <= interval < math.inf):
        return Reply(Result.DENIED, f"Cannot take {order.params[2]:g} pictures every {interval:g} s")
    if camera.trouble:
        return Reply(Result.TEMPORARILY_REJECTED, f"Cannot take pictures: {camera.trouble}")
    number = order.number(4) or 0
    if count == 1 and number > 0 and session.last_capture == number:
        return DONE  # the answer was lost
    session.last_capture = number if count == 1 else 0
    camera.order(session.autopilot, count, interval if count != 1 else 0.0)
    return DONE


def _stop_capture(session: Session, order: Order, now: float) -> Reply:
    camera = session.camera
    if camera is None or not camera.takes_pictures:
        return UNSUPPORTED
    camera.stop(session.autopilot)
    return DONE


def _set_mode(session: Session, order: Order, now: float) -> Reply:
    return DONE if order.number(2) == 0 else Reply(Result.DENIED, "The camera only takes pictures")


CAMERA_COMMANDS: Mapping[int, Callable[[Session, Order, float], Reply]] = {
    521: _legacy("CAMERA_INFORMATION"),
    522: _legacy("CAMERA_SETTINGS"),
    525: _legacy("STORAGE_INFORMATION"),
    527: _legacy("CAMERA_CAPTURE_STATUS"),
    530: _set_mode,
    2000: _start_capture,
    2001: _stop_capture,
    2504: _legacy("VIDEO_STREAM_INFORMATION"),
    2505: _legacy("VIDEO_STREAM_STATUS"),
}
"""What a camera does and other components do not."""

COMMANDS = {
    **{number: inquiries.COMMANDS[number] for number in (510, 511)},
    REQUEST_MESSAGE: _request_message,
    **CAMERA_COMMANDS,
}

SERVICES: Mapping[str, Callable[[Session, Camera, ReceivedMessage, float], None]] = {
    "COMMAND_LONG": _order,
    "COMMAND_INT": _order,
    "PARAM_EXT_REQUEST_LIST": _list,
    "PARAM_EXT_REQUEST_READ": _read,
    "PARAM_EXT_SET": _set,
    FILES: _file,
}
