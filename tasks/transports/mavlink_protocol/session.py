"""The conversation with one ground station: sequence numbers, rates, parameter list, answers."""

import itertools
from collections.abc import Callable
from typing import Any

from mavlink import Fields, Flavour, Received, encode, text
from tasks.transports.mavlink_protocol.orders import Dialogue
from tasks.transports.mavlink_protocol.parameters import ParameterEntry
from tasks.transports.mavlink_protocol.streams import STREAMS
from tasks.transports.mavlink_protocol.system import COMPONENT, MavlinkSystem
from tasks.transports.mavlink_protocol.transfers import PERIOD as FILE_PERIOD
from tasks.transports.mavlink_protocol.transfers import Asker

HEARTBEAT_PERIOD = 1.0
LIST_PERIOD = 0.02
LIST_BURST = 5
TEXTS_PER_SECOND, TEXT_BURST = 5.0, 15.0
DATAGRAMS_PER_SECOND, DATAGRAM_BURST = 500.0, 500.0
QUICKEST = 0.005
PATIENCE = 0.25  # s for the next item of a mission
SOON = 0.001  # s; what is due within this time is sent now: s since 1970 are only exact to a microsecond


class Session:
    """The conversation with one peer; `transmit` sends a frame to it.

    A peer is in contact from its first message until it has been silent too long; only then are texts sent to it.
    Times `now` are the vehicle's, of which `speed` seconds pass in one of the peer; rates are the peer's.
    """

    def __init__(
        self,
        autopilot: MavlinkSystem,
        flavour: Flavour,
        transmit: Callable[[bytes], object],
        now: float,
        speed: float = 1.0,
    ):
        self.autopilot = autopilot
        self.flavour = flavour
        self.heard_at = now
        self.contact = False
        self.admit = text.Tap(DATAGRAMS_PER_SECOND / speed, DATAGRAM_BURST, now)
        self.patience = PATIENCE * speed
        self._speed = speed
        self._transmit = transmit
        self._sequence = itertools.cycle(range(256))
        self._periods: dict[str, float] = {}
        self._due: dict[str, float] = {}
        self.dialogues: dict[tuple[int, int, int], Dialogue] = {}
        self.readers: dict[Asker, Received] = {}
        self._listing: list[ParameterEntry] = []
        self._listing_due = now
        self._texts = text.Tap(TEXTS_PER_SECOND / speed, TEXT_BURST, now)
        self._text_number = 0
        self._last_text = (now, "")

    def hear(self, message: Received, now: float) -> None:
        """Note the sender; a station that is new, or was silent, gets the latest notices."""
        self.heard_at = now
        if not self.contact:
            self.contact = True
            for severity, words in self.autopilot.notices:
                self._say(severity, words)

    def lose(self) -> None:
        """End the contact with a silent peer; the next one starts with the default rates."""
        self.contact = False
        self._periods.clear()
        self._due.clear()
        self._listing = []
        self.dialogues.clear()
        self.readers.clear()

    def send(self, name: str, fields: Fields) -> None:
        definition = self.autopilot.dialect.by_name[name]
        self._send_payload(name, definition.pack(fields))

    def answer(self, asker: Received, name: str, **fields: Any) -> None:
        """Send a message to the component that has sent another."""
        self.send(name, {"target_system": asker.system, "target_component": asker.component, **fields})

    def send_now(self, name: str, now: float, number: int = 0) -> bool:
        """Send an offered message, or one of its instances, once; False while the vehicle does not know its values."""
        found = STREAMS[name].instances(self.autopilot, self.flavour, now, number)
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
        """Start sending all parameters, a few at a time."""
        self._listing = list(reversed(list(self.autopilot.parameters)))
        self._listing_due = now

    def say(self, severity: int, words: str, now: float) -> None:
        """Send a text, unless it repeats the last one or there have been too many."""
        again = words == self._last_text[1] and now - self._last_text[0] < self._speed
        if self.contact and not again and self._texts.take(now):
            self._last_text = (now, words)
            self._say(severity, words)

    def period(self, name: str) -> float:
        """Seconds between two messages with a name; 0 if it is not streamed."""
        if name == "HEARTBEAT":
            return HEARTBEAT_PERIOD
        rate = self.autopilot.rates().get(name, 0.0)
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
        for name in ("HEARTBEAT", *dict.fromkeys((*self.autopilot.rates(), *self._periods))):
            period = self.period(name) * self._speed
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
                self.send_parameter(self._listing.pop())
            self._listing_due = now + LIST_PERIOD * self._speed
        due = min(*self._due.values(), self._listing_due if self._listing else now + HEARTBEAT_PERIOD * self._speed)
        if self.readers and self.autopilot.transfers.pump(self, now):
            due = min(due, now + FILE_PERIOD * self._speed)
        return due

    def _say(self, severity: int, words: str) -> None:
        self._text_number = self._text_number % 0xFFFF + 1
        for fields in text.chunks(severity, words, self._text_number):
            self.send("STATUSTEXT", fields)

    def _send_payload(self, name: str, payload: bytes) -> None:
        definition = self.autopilot.dialect.by_name[name]
        self._transmit(encode(definition, payload, next(self._sequence), self.autopilot.system, COMPONENT))


def addressed(message: Received, system: int) -> bool:
    """Whether a message is for this vehicle: sent to it, to all, or without a target, and not by itself."""
    values = message.values
    to_us = values.get("target_system", 0) in (0, system) and values.get("target_component", 0) in (0, COMPONENT)
    return to_us and (message.system, message.component) != (system, COMPONENT)
