"""Requests of ground stations to a camera: pictures, messages, extended parameters."""

import math
from collections.abc import Callable, Collection, Mapping
from functools import partial
from weakref import WeakKeyDictionary

from mavlink import ReceivedMessage, statustext
from mavlink.vehicle.camera.component import CameraComponent
from mavlink.vehicle.command import (
    DONE,
    CommandRequest,
    CommandResult,
    CommandService,
    MavResult,
    message_requests,
)
from mavlink.vehicle.files import FileAndLogTransfer
from mavlink.vehicle.parameters import ExtendedParameter
from mavlink.vehicle.service import Handler, MavlinkService
from mavlink.vehicle.session import Session, is_addressed

CAPTURED = 263
REFUSED = 1  # PARAM_ACK_VALUE_UNSUPPORTED
COMMANDS = ("COMMAND_LONG", "COMMAND_INT")
REQUEST_MESSAGE = 512
FTP = "FILE_TRANSFER_PROTOCOL"
UNSUPPORTED = CommandResult(MavResult.UNSUPPORTED)


class CameraService(MavlinkService):
    """Answers what is sent to one camera; files are the vehicle's: MAVSDK asks the camera itself for its definition.

    `moving` are the commands that act on the vehicle.
    """

    def __init__(self, camera: CameraComponent, files: FileAndLogTransfer, moving: Collection[int]) -> None:
        self._camera = camera
        self._last_capture: WeakKeyDictionary[Session, int] = WeakKeyDictionary()
        requests = message_requests.COMMANDS
        own: Mapping[int, Callable[[Session, CommandRequest, float], CommandResult]] = {
            **{number: requests[number] for number in (510, 511)},
            **{number: _legacy_request(name) for number, name in message_requests.LEGACY_REQUESTS.items()},
            REQUEST_MESSAGE: self._request_message,
            SET_MODE: self._set_mode,
            START_CAPTURE: self._start_capture,
            STOP_CAPTURE: self._stop_capture,
        }
        self._commands = CommandService(camera.model, own, moving)
        self._files = files

    @property
    def handlers(self) -> Mapping[str, Handler]:
        return {
            **self._commands.handlers,
            "PARAM_EXT_REQUEST_LIST": self._list,
            "PARAM_EXT_REQUEST_READ": self._read,
            "PARAM_EXT_SET": self._set,
            FTP: self._files.receive,
        }

    def forget(self, session: Session) -> None:
        self._commands.forget(session)

    def _list(self, session: Session, message: ReceivedMessage, now: float) -> None:
        camera = self._camera
        session.start_list_transfer([partial(send_parameter, session, camera, each) for each in camera.parameters], now)

    def _read(self, session: Session, message: ReceivedMessage, now: float) -> None:
        index, name = message.values["param_index"], message.values["param_id"]
        table = self._camera.parameters
        parameter = table.named(name) if index == -1 else table.at(index)
        if parameter is not None:
            send_parameter(session, self._camera, parameter)

    def _set(self, session: Session, message: ReceivedMessage, now: float) -> None:
        values = message.values
        parameter = self._camera.parameters.named(values["param_id"])
        if parameter is None:
            fields = {name: values[name] for name in ("param_id", "param_value", "param_type")}
            session.send("PARAM_EXT_ACK", {**fields, "param_result": REFUSED})
            return
        try:
            if session.refusal:
                raise ValueError(session.refusal)
            wanted = parameter.decode_param_value(_raw_value(message), values["param_type"])
        except ValueError as error:
            acknowledge_parameter(session, parameter, REFUSED)
            session.send_statustext(
                statustext.WARNING, f"{self._camera.label}, {parameter.declaration.name}: {error}", now
            )
            return
        self._camera.change_parameter(parameter, wanted, session, now)

    def _request_message(self, session: Session, order: CommandRequest, now: float) -> CommandResult:
        if order.integer_parameter(1) != CAPTURED or math.isnan(order.params[1]):
            return message_requests.COMMANDS[REQUEST_MESSAGE](session, order, now)
        index = order.integer_parameter(2)
        if index is None or not send_image_captured(session, self._camera, index):
            return CommandResult(MavResult.DENIED, f"There is no picture {order.params[1]:g}")
        return DONE

    def _start_capture(self, session: Session, order: CommandRequest, now: float) -> CommandResult:
        camera, count, interval = self._camera, order.integer_parameter(3), order.params[1]
        if not camera.takes_pictures:
            return UNSUPPORTED
        if count is None or count < 0 or (count != 1 and not 0.0 <= interval < math.inf):
            return CommandResult(MavResult.DENIED, f"Cannot take {order.params[2]:g} pictures every {interval:g} s")
        if camera.trouble:
            return CommandResult(MavResult.TEMPORARILY_REJECTED, f"Cannot take pictures: {camera.trouble}")
        number = order.integer_parameter(4) or 0
        if count == 1 and number > 0 and self._last_capture.get(session) == number:
            return DONE  # the answer was lost
        self._last_capture[session] = number if count == 1 else 0
        camera.start_capture(count, interval if count != 1 else 0.0)
        return DONE

    def _stop_capture(self, session: Session, order: CommandRequest, now: float) -> CommandResult:
        if not self._camera.takes_pictures:
            return UNSUPPORTED
        self._camera.stop_capture()
        return DONE

    def _set_mode(self, session: Session, order: CommandRequest, now: float) -> CommandResult:
        only_pictures = order.integer_parameter(2) == 0
        return DONE if only_pictures else CommandResult(MavResult.DENIED, "The camera only takes pictures")


def addressed_sessions(session: Session, message: ReceivedMessage) -> list[Session]:
    """The components that a message is for; an order to all is only for those that support it, a file for the first."""
    parts = (session, *session.cameras)
    found = [part for part in parts if is_addressed(message, part.source.system, part.source.component)]
    if message.name == FTP:
        return found[:1]
    if message.name not in COMMANDS or len(found) < 2:
        return found
    return [part for part in found[1:] if _supports(session, part, message)] or found[:1]


def send_image_captured(session: Session, camera: CameraComponent, index: int) -> bool:
    """Send CAMERA_IMAGE_CAPTURED; False if there is no such picture."""
    fields = camera.image_captured(index)
    if fields is not None:
        session.send("CAMERA_IMAGE_CAPTURED", fields)
    return fields is not None


def send_parameter(session: Session, camera: CameraComponent, parameter: ExtendedParameter) -> None:
    """Send PARAM_EXT_VALUE."""
    session.send(
        "PARAM_EXT_VALUE",
        {
            "param_id": parameter.id.encode(),
            "param_value": parameter.encoded,
            "param_type": parameter.type,
            "param_index": parameter.index,
            "param_count": len(camera.parameters),
        },
    )


def acknowledge_parameter(session: Session, parameter: ExtendedParameter, result: int) -> None:
    """Send PARAM_EXT_ACK with the present value."""
    fields = {"param_id": parameter.id.encode(), "param_value": parameter.encoded, "param_type": parameter.type}
    session.send("PARAM_EXT_ACK", {**fields, "param_result": result})


def _supports(session: Session, part: Session, message: ReceivedMessage) -> bool:
    """Whether an order that all get is meant for a camera."""
    command, first = message.values["command"], message.values["param1"]
    if command != REQUEST_MESSAGE:
        return command in CAMERA_COMMANDS
    definition = part.source.dialect.by_id.get(int(first)) if math.isfinite(first) else None
    if definition is None:
        return False
    return part.source.offers(definition.name) and not session.source.offers(definition.name)


def _raw_value(message: ReceivedMessage) -> bytes:
    """The value in PARAM_EXT_SET, with the zeros in it."""
    start = 2 + 16  # target and name
    return message.payload[start : start + 128]


def _legacy_request(name: str) -> Callable[[Session, CommandRequest, float], CommandResult]:
    """The older request for a message."""

    def request(session: Session, order: CommandRequest, now: float) -> CommandResult:
        return DONE if session.source.offers(name) and session.build_and_send(name, now) else UNSUPPORTED

    return request


SET_MODE, START_CAPTURE, STOP_CAPTURE = 530, 2000, 2001
CAMERA_COMMANDS = frozenset((*message_requests.LEGACY_REQUESTS, SET_MODE, START_CAPTURE, STOP_CAPTURE))
"""Commands of cameras that other components lack."""
