"""Interfaces of subscribers, transports and observers of a bus."""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Protocol

import imc

Handler = Callable[..., object]


@dataclass(frozen=True, slots=True, eq=False)
class Subscription:
    """One handler and what it receives.

    `type` is the type of the messages (Message: all), `others` adds those of other systems, `packets` adds the packet
    as second argument.
    """

    type: type
    handler: Handler
    owner: object = None
    others: bool = False
    packets: bool = False


class Transport(Protocol):
    """Carries packets between buses, below them: the order within a process is the same with or without it.

    What every transport keeps, and `tests/runtime/bus/transport_contract.py` checks: packets of one sender arrive in
    the order in which they were sent, each at most once, and never at their sender. Packets may be lost, but not
    silently: the transport counts them. A packet that was received is not sent on to other transports.
    """

    @property
    def systems(self) -> Collection[int]:
        """The systems (ids) that are on these buses themselves, so that their packets need no other way."""
        ...

    def open(self, receive: Callable[[bytes], None]) -> None:
        """Join the other buses; `receive` takes their packets, from any thread. Raises if it cannot join."""
        ...

    def send(self, message: imc.Message, packet: bytes) -> None:
        """Send a packet, which decodes to `message`. Never blocks, never raises, and does nothing after `close`."""
        ...

    def close(self) -> None:
        """Leave the other buses; nothing is received afterward. A second call does nothing."""
        ...


class BusObserver(Protocol):
    """Observes a bus; it must not change anything."""

    def on_subscribe(self, subscription: Subscription) -> None:
        """A subscription is about to begin."""
        ...

    def on_reconfigure(self, owner: object) -> None:
        """The owner of subscriptions now uses changed parameters."""
        ...
