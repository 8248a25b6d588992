"""The conversation with one peer: sequence numbers, rates, lists, texts."""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from mavlink import Dialect, Fields, Flavor, ReceivedMessage, encode, statustext
from mavlink.vehicle.packet_loss import SequenceTracker
from support.token_bucket import TokenBucket

HEARTBEAT_PERIOD = 1.0
LIST_PERIOD = 0.005
LIST_BURST = 5
FILE_PERIOD = 0.005  # s
STUCK_PERIOD = 0.05  # s after which a line that took nothing more is tried again
PACKETS_AT_ONCE = 8  # of a file, in a period
SHARE = 0.5  # of what a slow line carries, for a list or a file
PARAMETER, PART = 50.0, 280.0  # bytes of a parameter and of a part of a file, with a signature
TEXTS_PER_SECOND, TEXT_BURST = 5.0, 15.0
LOW_CHUNKS_PER_SECOND, LOW_CHUNK_BURST, LOW_NOTICES = 1.0, 4.0, 3  # of texts on slow links
DATAGRAMS_PER_SECOND, DATAGRAM_BURST = 500.0, 500.0
QUICKEST = 0.005
PATIENCE, LOW_PATIENCE = 0.25, 1.5  # s for the next item of a mission
SOON = 0.001  # s; what is due within this time is sent now: s since 1970 are only exact to a microsecond


class MessageSource(Protocol):
    """A component of the vehicle: who it is, and which messages it can send."""

    @property
    def dialect(self) -> Dialect: ...

    @property
    def system(self) -> int: ...

    @property
    def component(self) -> int: ...

    @property
    def latest_notices(self) -> Sequence[tuple[int, str]]:
        """The latest texts and their severities, for stations that are new."""
        ...

    def rates(self, low: bool) -> Mapping[str, float]:
        """Rates of the messages streamed by default, in Hz; `low` on slow links."""
        ...

    def offers(self, name: str) -> bool: ...

    def fields(self, name: str, flavor: Flavor, now: float, number: int = 0) -> Sequence[Fields]:
        """Fields of all messages with an offered name that can be sent now, or of the one with a number (from 1)."""
        ...


@dataclass(frozen=True, slots=True)
class LinkTraits:
    """Traits of the link to a peer.

    speed: seconds of the vehicle's time that pass in one of the peer's. line: bytes per second that reach it. low:
    whether it gets few of them unless it asks for more. sign: makes the signatures of frames. takes_more: whether what
    is sent now leaves at once; lists and files wait until it does.
    """

    flavor: Flavor
    speed: float = 1.0
    line: float = math.inf
    low: bool = False
    sign: Callable[[bytes], bytes] | None = None
    takes_more: Callable[[], bool] = lambda: True


class Session:
    """The conversation of a component with one peer; `transmit` sends a frame to it.

    A peer is in contact from its first message until it has been silent too long; only then are texts sent to it.
    Times `now` are the vehicle's, rates are the peer's. The session of the autopilot has those of the cameras in
    `cameras`.
    """

    def __init__(
        self,
        source: MessageSource,
        traits: LinkTraits,
        transmit: Callable[[bytes], object],
        now: float,
        cameras: "Sequence[Session]" = (),
    ):
        self.source = source
        self.cameras = cameras
        self.flavor: Flavor = traits.flavor
        self.low: bool = traits.low
        self.speed: float = traits.speed
        speed, line = traits.speed, traits.line
        self.received_at: float = now
        self.contact: bool = False
        self.refusal = ""  # why orders of the present message's sender are not obeyed
        self.received: SequenceTracker = SequenceTracker(speed)
        self.bucket: TokenBucket = TokenBucket(DATAGRAMS_PER_SECOND / speed, DATAGRAM_BURST)
        self.retry_period: float = (LOW_PATIENCE if self.low else PATIENCE) * speed
        self._transmit = transmit
        self._sign = traits.sign
        self._takes_more = traits.takes_more
        self._sequence = itertools.cycle(range(256))
        self._periods: dict[str, float] = {}
        self._due: dict[str, float] = {}
        self._list: list[Callable[[], object]] = []
        self._list_due = now
        self._list_period = max(LIST_PERIOD, LIST_BURST * PARAMETER / (SHARE * line)) * speed
        self._file: Callable[[float], bool] | None = None
        self._file_due = now
        self._file_period = max(FILE_PERIOD, PACKETS_AT_ONCE * PART / (SHARE * line)) * speed
        rate, burst = (LOW_CHUNKS_PER_SECOND, LOW_CHUNK_BURST) if self.low else (TEXTS_PER_SECOND, TEXT_BURST)
        self._texts = TokenBucket(rate / speed, burst)
        self._text_number = 0
        self._last_text = (now, "")

    def note_contact(self, now: float) -> None:
        """Note that the peer has sent something; one that is new, or was silent, gets the latest notices."""
        self.received_at = now
        for camera in self.cameras:
            camera.note_contact(now)
        if not self.contact:
            self.contact = True
            notices = self.source.latest_notices
            for severity, words in notices[-LOW_NOTICES:] if self.low else notices:
                self._send_chunks(self._chunks(severity, words))

    def end_contact(self) -> None:
        """End the contact with a silent peer; the next one starts with the default rates."""
        self.contact = False
        self._periods.clear()
        self._due.clear()
        self._list = []
        self._file = None
        for camera in self.cameras:
            camera.end_contact()

    def send(self, name: str, fields: Fields) -> None:
        self.send_payload(name, self.source.dialect.by_name[name].pack(fields))

    def send_payload(self, name: str, payload: bytes) -> None:
        definition, source = self.source.dialect.by_name[name], self.source
        self._transmit(encode(definition, payload, next(self._sequence), source.system, source.component, self._sign))

    def reply(self, asker: ReceivedMessage, name: str, **fields: Any) -> None:
        """Send a message to the component that has sent another."""
        self.send(name, {"target_system": asker.system, "target_component": asker.component, **fields})

    def build_and_send(self, name: str, now: float, number: int = 0) -> bool:
        """Send an offered message, or one of its instances, once; False while the vehicle has no values for it."""
        found = self.source.fields(name, self.flavor, now, number)
        for fields in found:
            self.send(name, fields)
        return bool(found)

    def start_list_transfer(self, sends: Sequence[Callable[[], object]], now: float) -> None:
        """Start sending the items of a list, a few at a time; a list that is not finished is dropped."""
        self._list = list(reversed(sends))
        self._list_due = now

    def start_file_transfer(self, send: Callable[[float], bool]) -> None:
        """Call `send(now)`, which sends PACKETS_AT_ONCE, as often as the line allows, until it returns False."""
        self._file = send

    def send_statustext(self, severity: int, words: str, now: float) -> None:
        """Send a text, unless it repeats the last one or there have been too many."""
        again = words == self._last_text[1] and now - self._last_text[0] < self.speed
        if self.contact and not again:
            chunks = self._chunks(severity, words)
            if self._texts.try_acquire(now, len(chunks) if self.low else 1.0):
                self._last_text = (now, words)
                self._send_chunks(chunks)

    def period(self, name: str) -> float:
        """Seconds between two messages with a name; 0 if it is not streamed."""
        if name == "HEARTBEAT":
            return HEARTBEAT_PERIOD
        rate = self.source.rates(self.low).get(name, 0.0)
        return self._periods.get(name, 1.0 / rate if rate > 0.0 else 0.0)

    def set_period(self, name: str, period: float | None) -> None:
        """Stream a message every `period` s; 0 stops it, None restores the default."""
        if period is None:
            self._periods.pop(name, None)
        else:
            self._periods[name] = max(period, QUICKEST) if period > 0.0 else 0.0

    def poll(self, now: float) -> float:
        """Send what is due, and return when the next message is due (s since 1970)."""
        for name in ("HEARTBEAT", *dict.fromkeys((*self.source.rates(self.low), *self._periods))):
            period = self.period(name) * self.speed
            due = self._due.get(name, now)
            if period <= 0.0:
                self._due.pop(name, None)
                continue
            if due > now + period:
                due = now + period
            if due < now + SOON:
                self.build_and_send(name, now)
                due = max(due + period, now)
            self._due[name] = due
        if self._list and self._list_due < now + SOON:
            self._list_due = now + self._send_of_list()
        due = min(*self._due.values(), self._list_due if self._list else now + HEARTBEAT_PERIOD * self.speed)
        if self._file is not None and self._file_due < now + SOON:
            self._file_due = now + self._send_of_file(self._file, now)
        due = min(due, self._file_due) if self._file is not None else due
        return min([due, *(camera.poll(now) for camera in self.cameras)])

    def _send_of_list(self) -> float:
        """Send the next items of the list; returns the time until more are due (s)."""
        if not self._takes_more():
            return STUCK_PERIOD * self.speed
        for _ in range(min(LIST_BURST, len(self._list))):
            self._list.pop()()
        return self._list_period

    def _send_of_file(self, send: Callable[[float], bool], now: float) -> float:
        """Send the next part of the file; returns the time until more is due (s)."""
        if not self._takes_more():
            return STUCK_PERIOD * self.speed
        if not send(now):
            self._file = None
        return self._file_period

    def _chunks(self, severity: int, words: str) -> list[Fields]:
        self._text_number = self._text_number % 0xFFFF + 1
        return statustext.chunks(severity, words, self._text_number)

    def _send_chunks(self, chunks: list[Fields]) -> None:
        for fields in chunks:
            self.send("STATUSTEXT", fields)


def is_addressed(message: ReceivedMessage, system: int, component: int = 1) -> bool:
    """Whether a message is for a component: sent to it, to all, or without a target, and not by itself."""
    values = message.values
    to_us = values.get("target_system", 0) in (0, system) and values.get("target_component", 0) in (0, component)
    return to_us and (message.system, message.component) != (system, component)
