"""Delivers each published message to those who asked for its type, in order of publication, never re-entrantly."""

import logging
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Protocol

import imc
from runtime.kernel import Kernel, owner_of

MOST_WAITING = 8192  # packets of other processes, while the kernel is busy

logger = logging.getLogger("shoal.bus")


class Transport(Protocol):
    """Carries packets between the processes of one bus, below it: local order stays with or without it."""

    def open(self, receive: Callable[[bytes], None]) -> None:
        """Begin; `receive` takes packets of other processes, from any thread."""
        ...

    def send(self, message: imc.Message, packet: bytes) -> None:
        """Hand a packet that was published here to the other processes; never waits."""
        ...

    def close(self) -> None: ...


@dataclass(frozen=True, slots=True, eq=False)
class Subscription:
    """One handler and what it wants: a type (Message is everything), others' messages too, the packet as well."""

    type: type
    handler: Callable[..., object]
    owner: object = None
    others: bool = False
    packets: bool = False


class Witness(Protocol):
    """Who is told of each subscription as it begins, and of each owner that follows changed parameters."""

    def subscribed(self, subscription: Subscription) -> None: ...

    def reconfigured(self, owner: object) -> None: ...


class Bus:
    """One in-process bus for one vehicle, `system` being its IMC id.

    Until `resume` it keeps what is published, so that nobody misses what others say while they start.
    `on_own` is told of each message of this vehicle that comes from another process.
    Everything that is delivered has been through the codec, so a receiver here sees what a receiver elsewhere would.
    Objects that are no messages (frames) are shared between tasks of this process and go nowhere else.
    Counted: `delivered`; of what other processes send, `malformed` and, where it came too fast, `overrun`.
    """

    def __init__(self, kernel: Kernel, system: int):
        self.kernel = kernel
        self.system = system
        self.delivered = 0
        self.on_own: Callable[[imc.Message], None] = lambda _: None
        self.witness: Witness | None = None
        self.malformed = 0
        self.overrun = 0
        self._waiting: deque[bytes] = deque()
        self._subscriptions: list[Subscription] = []
        self._routes: dict[type, tuple[Subscription, ...]] = {}
        self._transport: Transport | None = None
        self._backlog: list[tuple[imc.Message, bytes, object]] | None = []

    def resume(self) -> None:
        """Deliver what has been kept, and from now on at once."""
        kept, self._backlog = self._backlog or [], None
        for message, packet, origin in kept:
            self._deliver(message, packet, origin)

    def forget(self) -> None:
        """Drop what has been kept, and deliver from now on."""
        self._backlog = None

    @property
    def subscriptions(self) -> list[Subscription]:
        """All subscriptions, in the order in which they are served."""
        return list(self._subscriptions)

    def arrange(self, subscriptions: Iterable[Subscription]) -> None:
        """Serve exactly these subscriptions, in this order."""
        self._subscriptions = list(subscriptions)
        self._routes.clear()

    def knows(self, owner: object) -> bool:
        """Whether messages go to `owner`, or to its methods."""
        return any(s.owner is owner or owner_of(s.handler) is owner for s in self._subscriptions)

    def subscribe(self, subscription: Subscription) -> None:
        if self.witness is not None:
            self.witness.subscribed(subscription)
        self._subscriptions.append(subscription)
        self._routes.clear()

    def unsubscribe(self, owner: object) -> None:
        """Drop all subscriptions of `owner`."""
        self._subscriptions = [s for s in self._subscriptions if s.owner is not owner]
        self._routes.clear()

    def remove(self, subscription: Subscription) -> None:
        self._subscriptions = [s for s in self._subscriptions if s is not subscription]
        self._routes.clear()

    def publish(self, message: imc.Message, packet: bytes, origin: object) -> None:
        """Deliver `message`, which `packet` decodes to, to all but `origin`, here and on the transport."""
        self._deliver(message, packet, origin)
        if self._transport is not None:
            self._transport.send(message, packet)

    def share(self, frame: object, origin: object) -> None:
        """Deliver an object that is no message to the tasks of this process."""
        for subscription in self._route(type(frame)):
            if origin is None or subscription.owner is not origin:
                self.kernel.soon(subscription.handler, frame)

    def hear(self, message: imc.Message, packet: bytes) -> None:
        """Deliver what another bus of this process carries."""
        self._deliver(message, packet, None)

    @property
    def is_attached(self) -> bool:
        """Whether a transport carries what is published."""
        return self._transport is not None

    def attach(self, transport: Transport) -> None:
        """Join the processes that `transport` reaches."""
        transport.open(self._take)
        self._transport = transport

    def detach(self) -> None:
        """Leave the other processes."""
        transport, self._transport = self._transport, None
        if transport is not None:
            transport.close()

    def _take(self, packet: bytes) -> None:
        """Keep a packet for the kernel's thread; called from any other."""
        if len(self._waiting) < MOST_WAITING:
            self._waiting.append(packet)
            self.kernel.post(self._receive)
            return
        self.overrun += 1
        if self.overrun == 1:
            logger.warning("other processes send faster than this one hears, so packets are dropped and counted")

    def _receive(self) -> None:
        packet = self._waiting.popleft()
        if self._transport is None:
            return
        try:
            packet = imc.first_packet(packet)
            message = imc.decode(packet)
        except imc.DecodeError as error:
            self.malformed += 1
            if self.malformed == 1:
                logger.warning("a packet from another process is malformed: %s; further ones are counted", error)
            return
        if message.src == self.system:
            self.on_own(message)
        self._deliver(message, packet, None)

    def _deliver(self, message: imc.Message, packet: bytes, origin: object) -> None:
        if self._backlog is not None:
            self._backlog.append((message, packet, origin))
            return
        self.delivered += 1
        own = message.src == self.system
        soon: Callable[..., Any] = self.kernel.soon
        for subscription in self._routes.get(type(message)) or self._route(type(message)):
            if (own or subscription.others) and (origin is None or subscription.owner is not origin):
                if subscription.packets:
                    soon(subscription.handler, message, packet)
                else:
                    soon(subscription.handler, message)

    def _route(self, kind: type) -> tuple[Subscription, ...]:
        route = self._routes.get(kind)
        if route is None:
            route = tuple(s for s in self._subscriptions if issubclass(kind, s.type))
            self._routes[kind] = route
        return route
