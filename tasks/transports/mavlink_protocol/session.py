"""The conversation with one ground station: sequence numbers, rates, parameter list, answers."""

import itertools
from collections.abc import Callable
from typing import Any

from mavlink import Fields, Flavour, Received, encode, text
from tasks.transports.mavlink_protocol.parameters import ParameterEntry
from tasks.transports.mavlink_protocol.system import COMPONENT, MavlinkSystem

HEARTBEAT_PERIOD = 1.0
LIST_PERIOD = 0.02
LIST_BURST = 5
TEXTS_PER_SECOND, TEXT_BURST = 5.0, 15.0
DATAGRAMS_PER_SECOND, DATAGRAM_BURST = 500.0, 500.0
QUICKEST = 0.005
SOON = 0.001  # what is due so soon goes out now: seconds since 1970 are only good to a microsecond


class Session:
    """What the vehicle and one peer say to each other; `transmit` sends a frame to that peer.

    A peer is in contact from its first message on until it has been silent for long; texts wait for that.
    """

    def __init__(self, autopilot: MavlinkSystem, flavour: Flavour, transmit: Callable[[bytes], object], now: float):
        self.autopilot = autopilot
        self.flavour = flavour
        self.heard_at = now
        self.contact = False
        self.peer = (0, 0)
        self.admit = text.Tap(DATAGRAMS_PER_SECOND, DATAGRAM_BURST, now)
        self._transmit = transmit
        self._sequence = itertools.cycle(range(256))
        self._periods: dict[str, float] = {}
        self._due: dict[str, float] = {}
        self._listing: list[ParameterEntry] = []
        self._listing_due = now
        self._texts = text.Tap(TEXTS_PER_SECOND, TEXT_BURST, now)
        self._text_number = 0
        self._last_text = (now, "")

    def hear(self, message: Received, now: float) -> None:
        """Note who is there; a station that comes, or comes back, gets the last notices."""
        self.heard_at = now
        self.peer = (message.system, message.component)
        if not self.contact:
            self.contact = True
            for severity, words in self.autopilot.notices:
                self._say(severity, words)

    def lose(self) -> None:
        """The peer is silent; whoever comes next finds the default rates."""
        self.contact = False
        self._periods.clear()
        self._due.clear()
        self._listing = []

    def send(self, name: str, fields: Fields) -> None:
        definition = self.autopilot.dialect.by_name[name]
        self._send_payload(name, definition.pack(fields))

    def answer(self, name: str, **fields: Any) -> None:
        """Send a message to the component that asked last."""
        system, component = self.peer
        self.send(name, {"target_system": system, "target_component": component, **fields})

    def send_now(self, name: str, now: float) -> bool:
        """Send an offered message once; False while the vehicle does not know what it would say."""
        fields = self.autopilot.build(name, self.flavour, now)
        if fields is not None:
            self.send(name, fields)
        return fields is not None

    def send_parameter(self, entry: ParameterEntry) -> None:
        payload = self.autopilot.dialect.by_name["PARAM_VALUE"].pack(
            {
                "param_id": entry.id.encode(),
                "param_type": entry.type,
                "param_index": entry.index,
                "param_count": len(self.autopilot.parameters),
            }
        )
        # as bytes: an integer's pattern may be a signalling NaN, which does not survive as a float
        self._send_payload("PARAM_VALUE", entry.encoded(self.flavour) + payload[4:])

    def list_parameters(self, now: float) -> None:
        """Begin to send all parameters, a few at a time."""
        self._listing = list(reversed(list(self.autopilot.parameters)))
        self._listing_due = now

    def say(self, severity: int, words: str, now: float) -> None:
        """Send a text, unless it is the same again or there have been too many."""
        again = words == self._last_text[1] and now - self._last_text[0] < 1.0
        if self.contact and not again and self._texts.take(now):
            self._last_text = (now, words)
            self._say(severity, words)

    def period(self, name: str) -> float:
        """Seconds between two messages of a name; 0 where it is not streamed."""
        if name == "HEARTBEAT":
            return HEARTBEAT_PERIOD
        rate = self.autopilot.rates().get(name, 0.0)
        return self._periods.get(name, 1.0 / rate if rate > 0.0 else 0.0)

    def set_period(self, name: str, period: float | None) -> None:
        """Stream a message every so many seconds; 0 stops it, None is the default again."""
        if period is None:
            self._periods.pop(name, None)
        else:
            self._periods[name] = max(period, QUICKEST) if period > 0.0 else 0.0

    def pump(self, now: float) -> float:
        """Send what is due, and say when the next is."""
        for name in ("HEARTBEAT", *dict.fromkeys((*self.autopilot.rates(), *self._periods))):
            period = self.period(name)
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
            self._listing_due = now + LIST_PERIOD
        return min(*self._due.values(), self._listing_due if self._listing else now + HEARTBEAT_PERIOD)

    def _say(self, severity: int, words: str) -> None:
        self._text_number = self._text_number % 0xFFFF + 1
        for fields in text.chunks(severity, words, self._text_number):
            self.send("STATUSTEXT", fields)

    def _send_payload(self, name: str, payload: bytes) -> None:
        definition = self.autopilot.dialect.by_name[name]
        self._transmit(encode(definition, payload, next(self._sequence), self.autopilot.system, COMPONENT))


def addressed(message: Received, system: int) -> bool:
    """Whether a message is for this vehicle: to it, to all, or to nobody in particular, and not its own."""
    values = message.values
    to_us = values.get("target_system", 0) in (0, system) and values.get("target_component", 0) in (0, COMPONENT)
    return to_us and (message.system, message.component) != (system, COMPONENT)
