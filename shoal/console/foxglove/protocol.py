"""The Foxglove WebSocket protocol, version 1, without I/O: requests of viewers, and what a server sends.

Source: github.com/foxglove/ws-protocol, docs/spec.md; numbers in binary messages are little endian.
"""

import math
import struct
from collections.abc import Iterable, Mapping
from enum import IntEnum
from typing import Any, NamedTuple

import msgspec

SUBPROTOCOLS = ("foxglove.sdk.v1", "foxglove.websocket.v1")
"""Names under which viewers ask for it; the messages used here are the same in both."""
LONGEST_NAME = 512  # characters
_DATA = struct.Struct("<BIQ")
_TIME = struct.Struct("<BQ")
_CALL = struct.Struct("<BIII")
_PLAYBACK_REQUEST = struct.Struct("<BBfBQI")
_PLAYBACK_STATE = struct.Struct("<BBQfBI")
_PUBLISH, _CALL_REQUEST, _PLAYBACK_CONTROL = 1, 2, 3
_MESSAGE_DATA, _TIME_CODE, _CALL_RESPONSE, _PLAYBACK_CODE = 1, 2, 3, 5
PLAY, PAUSE = 0, 1

Json = dict[str, Any]


class ProtocolError(ValueError):
    """A frame that is not of the protocol, or asks for what is not offered; the text is for the viewer.

    `playback_request` is the id of a request to a playback, if it has one that can be read.
    """

    def __init__(self, text: str, playback_request: str | None = None) -> None:
        super().__init__(text)
        self.playback_request = playback_request


class StatusLevel(IntEnum):
    """Levels of what a viewer shows to its user."""

    INFO = 0
    WARNING = 1
    ERROR = 2


class PlaybackStatus(IntEnum):
    """The activity of a playback."""

    PLAYING = 0
    PAUSED = 1
    BUFFERING = 2
    ENDED = 3


class _Op(msgspec.Struct, tag_field="op", rename="camel", frozen=True):
    pass


class SubscribedChannel(msgspec.Struct, rename="camel", frozen=True):
    """A subscription with the number that the viewer gives it."""

    id: int
    channel_id: int


class Subscribe(_Op, tag="subscribe", frozen=True):
    subscriptions: list[SubscribedChannel]


class Unsubscribe(_Op, tag="unsubscribe", frozen=True):
    subscription_ids: list[int]


class GetParameters(_Op, tag="getParameters", frozen=True):
    """All parameters if no name is given."""

    parameter_names: list[str]
    id: str | None = None


class GivenParameter(msgspec.Struct, frozen=True):
    """A parameter; without a value it is to be removed."""

    name: str
    value: Any = None


class ChangeParameters(_Op, tag="setParameters", frozen=True):
    parameters: list[GivenParameter]
    id: str | None = None


class SubscribeParameterUpdates(_Op, tag="subscribeParameterUpdates", frozen=True):
    """All parameters if no name is given."""

    parameter_names: list[str]


class UnsubscribeParameterUpdates(_Op, tag="unsubscribeParameterUpdates", frozen=True):
    """All parameters if no name is given."""

    parameter_names: list[str]


class SubscribeConnectionGraph(_Op, tag="subscribeConnectionGraph", frozen=True):
    pass


class UnsubscribeConnectionGraph(_Op, tag="unsubscribeConnectionGraph", frozen=True):
    pass


class ServiceCall(NamedTuple):
    """A call of a service, with the number that the viewer gives it."""

    service: int
    call: int
    encoding: str
    data: bytes


class PlaybackRequest(NamedTuple):
    """Play or pause, at a speed, from another time (ns since 1970 UTC) if `seek` has one. `id` is in the answer."""

    plays: bool
    speed: float
    seek: int | None
    id: str


Request = (
    Subscribe
    | Unsubscribe
    | GetParameters
    | ChangeParameters
    | SubscribeParameterUpdates
    | UnsubscribeParameterUpdates
    | SubscribeConnectionGraph
    | UnsubscribeConnectionGraph
)
_decoder = msgspec.json.Decoder(Request)


def parse_text(text: str) -> Request:
    """The request in a text frame. Raises ProtocolError."""
    try:
        return _decoder.decode(text)
    except (msgspec.MsgspecError, UnicodeError, RecursionError) as error:
        raise ProtocolError(f"not a request that is offered: {error}") from None


def parse_binary(data: bytes) -> ServiceCall | PlaybackRequest:
    """The call of a service, or the request to a playback, in a binary frame. Raises ProtocolError."""
    if data[:1] == bytes([_PLAYBACK_CONTROL]):
        return _parse_playback_request(data)
    if not data or data[0] != _CALL_REQUEST:
        reason = (
            "publishing is not offered" if data[:1] == bytes([_PUBLISH]) else "not a binary message that is offered"
        )
        raise ProtocolError(reason)
    if len(data) < _CALL.size:
        raise ProtocolError("a call of a service is longer")
    _, service, call, length = _CALL.unpack_from(data)
    if length > len(data) - _CALL.size:
        raise ProtocolError("the encoding of a call is longer than its frame")
    end = _CALL.size + length
    return ServiceCall(service, call, data[_CALL.size : end].decode(errors="replace"), data[end:])


def _parse_playback_request(data: bytes) -> PlaybackRequest:
    if len(data) < _PLAYBACK_REQUEST.size:
        raise ProtocolError("a request to a playback is longer")
    _, command, speed, has_seek, seek, length = _PLAYBACK_REQUEST.unpack_from(data)
    if length != len(data) - _PLAYBACK_REQUEST.size or length > LONGEST_NAME:
        raise ProtocolError("the id of a request to a playback has another length than its frame")
    number = data[_PLAYBACK_REQUEST.size :].decode(errors="replace")
    if command not in (PLAY, PAUSE) or not math.isfinite(speed) or speed < 0.0:
        raise ProtocolError(f"no request to a playback: command {command} at speed {speed:g}", number)
    return PlaybackRequest(command == PLAY, speed, seek if has_seek else None, number)


def playback_state_data(status: PlaybackStatus, time: int, speed: float, request: str, *, did_seek: bool) -> bytes:
    """The state of a playback at a time (ns since 1970 UTC); `request` is the id of that which this answers."""
    number = request.encode()
    return _PLAYBACK_STATE.pack(_PLAYBACK_CODE, status, time, speed, did_seek, len(number)) + number


def message_data(subscription: int, time: int, data: bytes) -> bytes:
    """A message for a subscription; time in ns since 1970 UTC."""
    return _DATA.pack(_MESSAGE_DATA, subscription, time) + data


def time_message(time: int) -> bytes:
    """The time of the vehicles, in ns since 1970 UTC."""
    return _TIME.pack(_TIME_CODE, time)


def call_response(call: ServiceCall, data: bytes) -> bytes:
    """The answer to a call, in its encoding."""
    encoding = call.encoding.encode()
    return _CALL.pack(_CALL_RESPONSE, call.service, call.call, len(encoding)) + encoding + data


def call_failure(call: ServiceCall, reason: str) -> str:
    return _text({"op": "serviceCallFailure", "serviceId": call.service, "callId": call.call, "message": reason})


def server_info(
    name: str,
    capabilities: Iterable[str],
    session: str,
    metadata: Mapping[str, str],
    span: tuple[int, int] | None = None,
) -> str:
    """The first message; `session` shows a viewer that connects again whether channels have kept their numbers.

    `span` are the first and the last time (ns since 1970 UTC) of what is played.
    """
    words: Json = {"capabilities": list(capabilities), "supportedEncodings": ["cdr", "json"]}
    for key, time in zip(("dataStartTime", "dataEndTime"), span or (), strict=False):
        words[key] = dict(zip(("sec", "nsec"), divmod(time, 1_000_000_000), strict=True))
    return _text({"op": "serverInfo", "name": name, **words, "metadata": dict(metadata), "sessionId": session})


def status(level: StatusLevel, text: str, id: str = "") -> str:
    """A sentence for the user of the viewer; it replaces the last one with the same `id`."""
    return _text({"op": "status", "level": int(level), "message": text, **({"id": id} if id else {})})


def advertise(channels: Iterable[Json]) -> str:
    return _text({"op": "advertise", "channels": list(channels)})


def advertise_services(services: Iterable[Json]) -> str:
    return _text({"op": "advertiseServices", "services": list(services)})


def parameter_values(values: Iterable[Json], id: str | None) -> str:
    """Parameters with their values; `id` is that of the request that this answers."""
    return _text({"op": "parameterValues", "parameters": list(values), **({} if id is None else {"id": id})})


def connection_graph_update(
    published: Mapping[str, Iterable[str]],
    subscribed: Mapping[str, Iterable[str]],
    services: Mapping[str, Iterable[str]],
    removed: Iterable[str],
) -> str:
    """Publishers and subscribers of each topic, and providers of each service, of those that have changed."""
    return _text(
        {
            "op": "connectionGraphUpdate",
            "publishedTopics": [{"name": name, "publisherIds": sorted(ids)} for name, ids in published.items()],
            "subscribedTopics": [{"name": name, "subscriberIds": sorted(ids)} for name, ids in subscribed.items()],
            "advertisedServices": [{"name": name, "providerIds": sorted(ids)} for name, ids in services.items()],
            "removedTopics": sorted(removed),
            "removedServices": [],
        }
    )


def _text(value: Json) -> str:
    return msgspec.json.encode(value).decode()
