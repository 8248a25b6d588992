"""The conversation with one ground station: sequence numbers, rates, parameter list, answers."""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from mavlink import Fields, Flavor, ReceivedMessage, encode, statustext
from support.rate_limit import TokenBucket
from tasks.transports.mavlink_protocol.cameras import Camera
from tasks.transports.mavlink_protocol.orders import Dialogue
from tasks.transports.mavlink_protocol.parameters import ParameterEntry
from tasks.transports.mavlink_protocol.receipts import Receipts
from tasks.transports.mavlink_protocol.streams import STREAMS
from tasks.transports.mavlink_protocol.system import COMPONENT, MavlinkSystem
from tasks.transports.mavlink_protocol.transfers import AT_ONCE, Asker
from tasks.transports.mavlink_protocol.transfers import PERIOD as FILE_PERIOD

HEARTBEAT_PERIOD = 1.0
LIST_PERIOD = 0.005
LIST_BURST = 5
SHARE = 0.5  # of what a slow line carries, for a list or a file
PARAMETER, PART = 50.0, 280.0  # bytes of a parameter and of a part of a file, with a signature
TEXTS_PER_SECOND, TEXT_BURST = 5.0, 15.0
LOW_CHUNKS_PER_SECOND, LOW_CHUNK_BURST, LOW_NOTICES = 1.0, 4.0, 3  # of texts on slow links
LOW: Mapping[str, float] = {name: stream.low for name, stream in STREAMS.items()}
"""The default rates of slow links."""

DATAGRAMS_PER_SECOND, DATAGRAM_BURST = 500.0, 500.0
QUICKEST = 0.005
PATIENCE, LOW_PATIENCE = 0.25, 1.5  # s for the next item of a mission
SOON = 0.001  # s; what is due within this time is sent now: s since 1970 are only exact to a microsecond


class Session:
    """The conversation with one peer; `transmit` sends a frame to it.

    A peer is in contact from its first message until it has been silent too long; only then are texts sent to it.
    Times `now` are the vehicle's, of which `speed` seconds pass in one of the peer; rates are the peer's. `line` is how
    many bytes per second reach the peer; `low` is whether it gets few of them unless it asks for more. `sign` makes the
    signatures of frames. It is the conversation of the autopilot or of a `camera`; that of the autopilot has those of
    the cameras in `cameras`, except on slow links.
    """

    def __init__(
        self,
        autopilot: MavlinkSystem,
        flavour: Flavor,
        transmit: Callable[[bytes], object],
        now: float,
        speed: float = 1.0,
        *,
        line: float = math.inf,
        low: bool = False,
        sign: Callable[[bytes], bytes] | None = None,
        camera: Camera | None = None,
    ):
        self.autopilot = autopilot
        self.camera = camera
        self.component = COMPONENT if camera is None else camera.component
        self.streams = STREAMS if camera is None else camera.streams
        mounted = autopilot.cameras if camera is None and not low else ()
        self.cameras = [
            Session(autopilot, flavour, transmit, now, speed, line=line, sign=sign, camera=camera) for camera in mounted
        ]
        self.flavour = flavour
        self.low = low
        self.heard_at = now
        self.contact = False
        self.receipts = Receipts(speed)
        self.admit = TokenBucket(DATAGRAMS_PER_SECOND / speed, DATAGRAM_BURST, now)
        self.patience = (LOW_PATIENCE if low else PATIENCE) * speed
        self.speed = speed
        self._transmit = transmit
        self._sign = sign
        self._sequence = itertools.cycle(range(256))
        self._periods: dict[str, float] = {}
        self._due: dict[str, float] = {}
        self.dialogues: dict[tuple[int, int, int], Dialogue] = {}
        self.readers: dict[Asker, ReceivedMessage] = {}
        self.last_capture = 0
        self._listing: list[Callable[[], object]] = []
        self._listing_due = now
        self._listing_period = max(LIST_PERIOD, LIST_BURST * PARAMETER / (SHARE * line)) * speed
        self._reading_due = now
        self._reading_period = max(FILE_PERIOD, AT_ONCE * PART / (SHARE * line)) * speed
        rate, burst = (LOW_CHUNKS_PER_SECOND, LOW_CHUNK_BURST) if low else (TEXTS_PER_SECOND, TEXT_BURST)
        self._texts = TokenBucket(rate / speed, burst, now)
        self._text_number = 0
        self._last_text = (now, "")

    def hear(self, message: ReceivedMessage, now: float) -> None:
        """Note the sender; a station that is new, or was silent, gets the latest notices."""
        self.heard_at = now
        for camera in self.cameras:
            camera.hear(message, now)
        if not self.contact:
            self.contact = True
            notices = list(self.autopilot.notices) if self.camera is None else []
            for severity, words in notices[-LOW_NOTICES:] if self.low else notices:
                self._say(self._chunks(severity, words))

    def lose(self) -> None:
        """End the contact with a silent peer; the next one starts with the default rates."""
        self.contact = False
        self._periods.clear()
        self._due.clear()
        self._listing = []
        self.dialogues.clear()
        self.readers.clear()
        for camera in self.cameras:
            camera.lose()

    def send(self, name: str, fields: Fields) -> None:
        definition = self.autopilot.dialect.by_name[name]
        self._send_payload(name, definition.pack(fields))

    def answer(self, asker: ReceivedMessage, name: str, **fields: Any) -> None:
        """Send a message to the component that has sent another."""
        self.send(name, {"target_system": asker.system, "target_component": asker.component, **fields})

    def send_now(self, name: str, now: float, number: int = 0) -> bool:
        """Send an offered message, or one of its instances, once; False while the vehicle does not know its values."""
        found = self.streams[name].instances(self.autopilot, self.flavour, now, number)
        for fields in found:
            self.send(name, fields)
        return bool(found)

    def send_parameter(self, entry: ParameterEntry) -> None:
        payload = self.autopilot.dialect.by_name["PARAM_VALUE"].pack(
            {
                "param_id": entry.id.encode(),
                "param_type": entry.type,
                "param_index": entry.index,
                "param_count": len(self.autopilot.parameters),
            }
        )
        # As bytes: those of an integer may be a signaling NaN, which packing as a float would change.
        self._send_payload("PARAM_VALUE", entry.encoded(self.flavour) + payload[4:])

    def list_parameters(self, now: float) -> None:
        self.send_all([partial(self.send_parameter, entry) for entry in self.autopilot.parameters], now)

    def send_all(self, sends: Sequence[Callable[[], object]], now: float) -> None:
        """Start sending the items of a list, a few at a time; a list that is not finished is dropped."""
        self._listing = list(reversed(sends))
        self._listing_due = now

    def say(self, severity: int, words: str, now: float) -> None:
        """Send a text, unless it repeats the last one or there have been too many."""
        again = words == self._last_text[1] and now - self._last_text[0] < self.speed
        if self.contact and not again:
            chunks = self._chunks(severity, words)
            if self._texts.try_acquire(now, len(chunks) if self.low else 1.0):
                self._last_text = (now, words)
                self._say(chunks)

    def period(self, name: str) -> float:
        """Seconds between two messages with a name; 0 if it is not streamed."""
        if name == "HEARTBEAT":
            return HEARTBEAT_PERIOD
        rate = self._rates().get(name, 0.0)
        return self._periods.get(name, 1.0 / rate if rate > 0.0 else 0.0)

    def set_period(self, name: str, period: float | None) -> None:
        """Stream a message every `period` s; 0 stops it, None restores the default."""
        if period is None:
            self._periods.pop(name, None)
        else:
            self._periods[name] = max(period, QUICKEST) if period > 0.0 else 0.0

    def pump(self, now: float) -> float:
        """Send what is due, and return when the next message is due (s since 1970)."""
        self.autopilot.forget_old(now)
        for name in ("HEARTBEAT", *dict.fromkeys((*self._rates(), *self._periods))):
            period = self.period(name) * self.speed
            due = self._due.get(name, now)
            if period <= 0.0:
                self._due.pop(name, None)
                continue
            if due > now + period:
                due = now + period
            if due < now + SOON:
                self.send_now(name, now)
                due = max(due + period, now)
            self._due[name] = due
        if self._listing and self._listing_due < now + SOON:
            for _ in range(min(LIST_BURST, len(self._listing))):
                self._listing.pop()()
            self._listing_due = now + self._listing_period
        due = min(*self._due.values(), self._listing_due if self._listing else now + HEARTBEAT_PERIOD * self.speed)
        if self.readers and self._reading_due < now + SOON:
            self.autopilot.transfers.pump(self, now)
            self._reading_due = now + self._reading_period
        due = min(due, self._reading_due) if self.readers else due
        return min([due, *(camera.pump(now) for camera in self.cameras)])

    def _rates(self) -> Mapping[str, float]:
        """Of what is streamed by default, in Hz."""
        if self.camera is not None:
            return self.camera.rates
        return LOW if self.low else self.autopilot.rates()

    def _chunks(self, severity: int, words: str) -> list[Fields]:
        self._text_number = self._text_number % 0xFFFF + 1
        return statustext.chunks(severity, words, self._text_number)

    def _say(self, chunks: list[Fields]) -> None:
        for fields in chunks:
            self.send("STATUSTEXT", fields)

    def _send_payload(self, name: str, payload: bytes) -> None:
        definition = self.autopilot.dialect.by_name[name]
        system = self.autopilot.system
        self._transmit(encode(definition, payload, next(self._sequence), system, self.component, self._sign))


def addressed(message: ReceivedMessage, system: int, component: int = COMPONENT) -> bool:
    """Whether a message is for a component: sent to it, to all, or without a target, and not by itself."""
    values = message.values
    to_us = values.get("target_system", 0) in (0, system) and values.get("target_component", 0) in (0, component)
    return to_us and (message.system, message.component) != (system, component)
