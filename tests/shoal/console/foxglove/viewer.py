"""A viewer of Foxglove's protocol, written from its specification."""

import json
import struct
import time
from collections import Counter
from typing import Any

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from websockets.sync.client import connect

from tests.outside import PATIENCE

SDK, OLD = "foxglove.sdk.v1", "foxglove.websocket.v1"


class Viewer:
    """One connection: what it has received, by kind; `read` brings more."""

    def __init__(self, url: str, subprotocol: str = SDK, **options: Any) -> None:
        self.socket = connect(url, subprotocols=[subprotocol], ping_interval=None, max_size=None, **options)
        self.connection = self.socket.__enter__()
        self.channels: dict[str, dict[str, Any]] = {}
        self.services: dict[str, int] = {}
        self.said: list[dict[str, Any]] = []
        self.messages: list[tuple[int, int, bytes]] = []
        self.times: list[int] = []
        self.answers: dict[int, tuple[str, bytes]] = {}
        self.playback: list[tuple[int, float, float, bool, str]] = []
        self.counts: Counter[str] = Counter()

    def close(self) -> None:
        self.socket.__exit__(None, None, None)

    def __enter__(self) -> "Viewer":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def send(self, op: str, **words: object) -> None:
        self.connection.send(json.dumps({"op": op, **words}))

    def subscribe(self, topic: str, number: int) -> None:
        channel = self.until(lambda: self.channels.get(topic))
        self.send("subscribe", subscriptions=[{"id": number, "channelId": channel["id"]}])

    def call(self, service: str, number: int, data: bytes = b"", encoding: str = "json") -> Any:
        """The answer to a call, or the failure."""
        known = self.until(lambda: self.services.get(service))
        self.send_call(known, number, data, encoding)

        def answer() -> Any:
            failures = (each for each in self.of("serviceCallFailure") if each["callId"] == number)
            return self.answers.get(number) or next(failures, None)

        return self.until(answer)

    def send_call(self, service: int, number: int, data: bytes, encoding: str) -> None:
        name = encoding.encode()
        self.connection.send(struct.pack("<BIII", 2, service, number, len(name)) + name + data)

    def control(self, number: str, plays: bool, speed: float = 0.0, seek: float | None = None) -> tuple[Any, ...]:
        """The state of the playback that answers a request; `seek` in s since 1970."""
        name, moment = number.encode(), round((seek or 0.0) * 1e9)
        head = struct.pack("<BBfBQI", 3, 0 if plays else 1, speed, seek is not None, moment, len(name))
        self.connection.send(head + name)
        return self.until(lambda: next((each for each in self.playback if each[-1] == number), None))

    def of(self, op: str) -> list[dict[str, Any]]:
        return [each for each in self.said if each["op"] == op]

    def until(self, condition: Any, timeout: float = PATIENCE) -> Any:
        """Read until a condition holds; returns what it returns."""
        deadline = time.monotonic() + timeout
        while not (found := condition()):
            assert time.monotonic() < deadline, (self.said[-5:], self.counts)
            self.read(0.2)
        return found

    def status(self, text: str) -> dict[str, Any]:
        """The first status with a text."""
        return self.until(lambda: next((each for each in self.of("status") if text in each["message"]), None))

    def read(self, timeout: float) -> None:
        """Take one frame, if one comes."""
        try:
            frame = self.connection.recv(timeout)
        except TimeoutError:
            return
        if isinstance(frame, str):
            self._read_text(json.loads(frame))
            return
        match frame[0]:
            case 1:
                self.messages.append((*struct.unpack_from("<IQ", frame, 1), frame[13:]))
            case 2:
                self.times.append(struct.unpack_from("<Q", frame, 1)[0])
            case 3:
                _, number, length = struct.unpack_from("<III", frame, 1)
                self.answers[number] = frame[13 : 13 + length].decode(), frame[13 + length :]
            case 5:
                status, moment, speed, did_seek, length = struct.unpack_from("<BQfBI", frame, 1)
                number = frame[19 : 19 + length].decode()
                self.playback.append((status, moment / 1e9, speed, bool(did_seek), number))
            case _:
                raise AssertionError(frame[:20])

    def _read_text(self, said: dict[str, Any]) -> None:
        self.counts[said["op"]] += 1
        match said["op"]:
            case "advertise":
                self.channels |= {channel["topic"]: channel for channel in said["channels"]}
            case "advertiseServices":
                self.services |= {service["name"]: service["id"] for service in said["services"]}
        self.said.append(said)

    def decode(self, topic: str, data: bytes) -> Any:
        """A message of a topic, read by rosbags with the definition that was advertised."""
        channel = self.channels[topic]
        assert (channel["encoding"], channel["schemaEncoding"]) == ("cdr", "ros2msg")
        store = get_typestore(Stores.EMPTY)
        store.register(get_types_from_msg(channel["schema"], channel["schemaName"]))
        return store.deserialize_cdr(data, channel["schemaName"])
