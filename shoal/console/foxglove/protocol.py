"""The Foxglove WebSocket protocol, version 1, without I/O: requests of viewers, and what a server sends.

Source: github.com/foxglove/ws-protocol, docs/spec.md; numbers in binary messages are little endian.
"""

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
_PUBLISH, _CALL_REQUEST = 1, 2
_MESSAGE_DATA, _TIME_CODE, _CALL_RESPONSE = 1, 2, 3

Json = dict[str, Any]


class ProtocolError(ValueError):
    """A frame that is not of the protocol, or asks for what is not offered; the text is for the viewer."""


class StatusLevel(IntEnum):
    """Levels of what a viewer shows to its user."""

    INFO = 0
    WARNING = 1
    ERROR = 2


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


def parse_binary(data: bytes) -> ServiceCall:
    """The call in a binary frame. Raises ProtocolError."""
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


def server_info(name: str, capabilities: Iterable[str], session: str, metadata: Mapping[str, str]) -> str:
    """The first message; a viewer that connects again knows by `session` that channels have kept their numbers."""
    words = {"capabilities": list(capabilities), "supportedEncodings": ["cdr", "json"]}
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
