"""Delivers each published message to the subscribers of its type, in order of publication, never re-entrantly."""

import logging
import time
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, replace
from typing import Protocol

import imc
from imc.addresses import UNKNOWN_SYSTEM
from imc.layout import SMALLEST_PACKET
from runtime.bus.frame import Frame, FrameCarrier
from runtime.bus.inbox import Inbox, Request
from runtime.kernel import Kernel, owner_of

AT_ONCE = 64  # packets from other processes taken at a time; then the vehicle's own timers come first
BYTES_AT_ONCE = 1 << 14  # of them, after which the timers come first even if there were fewer packets

Route = tuple[tuple[Callable[..., object], object, bool], ...]  # handler, owner, whether it takes the packet, too

logger = logging.getLogger("shoal.bus")


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
        """Leave the other buses; nothing is received afterwards. A second call does nothing."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Subscription:
    """One handler and what it receives.

    `type` is the type of the messages (Message: all), `others` adds those of other systems, `packets` adds the packet
    as second argument.
    """

    type: type
    handler: Callable[..., object]
    owner: object = None
    others: bool = False
    packets: bool = False


def known_here(kind: type[imc.Message], schema: imc.Schema) -> type[imc.Message]:
    """The class of `schema` for a message of another one. Raises imc.SchemaError if it has no such message."""
    ours = schema.by_id(kind.ID) if kind.ID in schema.types_by_id else None
    if ours is None or imc.signature(ours) != imc.signature(kind):
        raise imc.SchemaError(
            f"{kind.__name__} (id {kind.ID}) is not a message of this vehicle: add its file to [General] Messages"
        )
    return ours


def _check_class(kind: object) -> None:
    if not isinstance(kind, type):
        raise TypeError(f"expected the class of a message, such as imc.GpsFix, not {kind!r}")


class BusInstrument(Protocol):
    """Observes a bus; it must not change anything."""

    def subscribed(self, subscription: Subscription) -> None:
        """A subscription is about to begin."""
        ...

    def reconfigured(self, owner: object) -> None:
        """The owner of subscriptions now uses changed parameters."""
        ...


class Bus:
    """The in-process bus of one vehicle, whose IMC id is `system`.

    Until `resume` it keeps what is published, so that no task misses what others publish while they start.
    All that is delivered has been through the codec: a receiver here gets the same values as one elsewhere.
    Frames are not messages: they are shared between the tasks of this process, and `frames`, if there is one, carries
    them to other processes of the vehicle.
    What other processes send waits in `inbox`, and gets at most half of the time of a wall clock while the vehicle has
    work to do.
    `admit` says of each message of this vehicle that another process has sent whether to take it. `decline` gets the
    system that has sent what cannot be read, and the reason.
    Counted: `delivered`; of the packets from other processes `malformed`, `refused` by `admit`, and `inbox.dropped` if
    they arrive too fast.
    """

    def __init__(self, kernel: Kernel, system: int):
        self.kernel = kernel
        self.system = system
        self.speak(imc.builtin())
        self.delivered = 0
        self.instruments: list[BusInstrument] = []
        self.malformed = self.refused = 0
        self.admit: Callable[[imc.Message], bool] = lambda _: True
        self.decline: Callable[[int, str], object] = lambda _, __: None
        self.inbox = Inbox()
        self.frames: FrameCarrier | None = None
        self._shown: dict[str, Frame] = {}
        self._subscriptions: list[Subscription] = []
        self._routes: dict[type, tuple[Subscription, ...]] = {}
        self._of_own: dict[type, Route] = {}
        self._of_others: dict[type, Route] = {}
        self._transports: list[Transport] = []
        self._backlog: list[tuple[imc.Message, bytes, object]] | None = []

    def speak(self, schema: imc.Schema) -> None:
        """Carry the messages of this schema, instead of the built-in one."""
        self.messages = schema
        codec = schema.codec
        self.decode, self.decode_first, self.reread = codec.decode, codec.decode_first, codec.reread

    def resume(self) -> None:
        """Deliver what has been kept, and from now on everything immediately."""
        kept, self._backlog = self._backlog or [], None
        for message, packet, origin in kept:
            self._deliver(message, packet, origin)

    def forget(self) -> None:
        """Drop what has been kept, and deliver everything from now on."""
        self._backlog = None

    @property
    def subscriptions(self) -> list[Subscription]:
        """All subscriptions, in the order in which they are served."""
        return list(self._subscriptions)

    def arrange(self, subscriptions: Iterable[Subscription]) -> None:
        """Serve exactly these subscriptions, in this order."""
        self._subscriptions = list(subscriptions)
        self._forget_routes()

    def knows(self, owner: object) -> bool:
        """Whether `owner` or one of its methods receives messages."""
        return any(s.owner is owner or owner_of(s.handler) is owner for s in self._subscriptions)

    def subscribe(self, subscription: Subscription) -> None:
        subscription = self._translated(subscription)
        for instrument in self.instruments:
            instrument.subscribed(subscription)
        self._subscriptions.append(subscription)
        self._forget_routes()
        if self.frames is not None and issubclass(Frame, subscription.type):
            self.frames.want(self._take_frame)

    def _translated(self, subscription: Subscription) -> Subscription:
        """With the class that this bus delivers, if the subscriber has loaded its own definitions of the message."""
        kind = subscription.type
        _check_class(kind)
        if not issubclass(kind, imc.Message) or kind.SCHEMA is None or kind.SCHEMA is self.messages:
            return subscription
        return replace(subscription, type=known_here(kind, self.messages))

    def unsubscribe(self, owner: object) -> None:
        """Drop all subscriptions of `owner`."""
        self._subscriptions = [s for s in self._subscriptions if s.owner is not owner]
        self._forget_routes()

    def remove(self, subscription: Subscription) -> None:
        self._subscriptions = [s for s in self._subscriptions if s is not subscription]
        self._forget_routes()

    def publish(self, message: imc.Message, packet: bytes, origin: object) -> None:
        """Deliver `message`, which `packet` decodes to, to all but `origin`, and send it on all transports."""
        self._deliver(message, packet, origin)
        for transport in self._transports:
            transport.send(message, packet)

    def share(self, frame: object, origin: object) -> None:
        """Deliver a frame to the tasks of this process, and to other processes of the vehicle."""
        self._show(frame, origin)
        if self.frames is not None and isinstance(frame, Frame):
            self.frames.share(frame)

    def _show(self, frame: object, origin: object) -> None:
        for subscription in self._route(type(frame)):
            if origin is None or subscription.owner is not origin:
                self.kernel.soon(subscription.handler, frame)

    def _take_frame(self, frame: Frame) -> None:
        """Keep the newest frame of a camera for the kernel's thread; called from any other thread."""
        self._shown[frame.camera] = frame
        self.kernel.post(self._show_newest, frame.camera)

    def _show_newest(self, camera: str) -> None:
        if (frame := self._shown.pop(camera, None)) is not None:
            self._show(frame, None)

    def hear(self, message: imc.Message, packet: bytes) -> None:
        """Deliver a message from another bus of this process."""
        self._deliver(message, packet, None)

    @property
    def is_attached(self) -> bool:
        """Whether any transport carries what is published."""
        return bool(self._transports)

    def reaches(self, system: int) -> bool:
        """Whether another system is on the buses that transports join, so that its packets come from there."""
        return any(system in transport.systems for transport in self._transports)

    def attach(self, transport: Transport) -> None:
        """Join the buses that `transport` reaches; transports attached earlier stay.

        Raises what `transport.open` raises; the bus is then as before.
        """
        transport.open(self._take)
        self._transports.append(transport)

    def detach(self) -> None:
        """Close all transports, the last one first. All are closed even if one fails; the first error is raised."""
        errors: list[Exception] = []
        while self._transports:
            try:
                self._transports.pop().close()
            except Exception as error:
                if errors:
                    logger.error("while closing another transport: %r", error)
                errors.append(error)
        if errors:
            raise errors[0]

    def _take(self, packet: bytes) -> None:
        """Queue a packet for the kernel's thread; called from any other thread."""
        if self.inbox.put(packet):
            self.kernel.post(self._serve)

    def _serve(self) -> None:
        """Take some packets; take more after what they cause and, if the vehicle has work to do, as long a pause."""
        began = time.perf_counter()
        packets = self.inbox.take(len(self.inbox)) if self.kernel.virtual else self.inbox.take(AT_ONCE, BYTES_AT_ONCE)
        for packet in packets:
            self._receive(packet)
        self.kernel.soon(self._go_on, began)

    def _go_on(self, began: float) -> None:
        if not self.inbox.rest():
            return
        if self.kernel.virtual:
            self.kernel.post(self._serve)
        else:
            self.kernel.put_off((time.perf_counter() - began) * self.kernel.clock.speed, self._serve)

    def _receive(self, packet: bytes) -> None:
        if not self._transports:
            return
        request = packet if isinstance(packet, Request) else None
        try:
            message, packet = self.decode_first(packet)
        except imc.DecodeError as error:
            self.malformed += 1
            self.decline(imc.packet_source(packet) if len(packet) >= SMALLEST_PACKET else UNKNOWN_SYSTEM, error.reason)
            return
        if message.src == self.system and not self.admit(message):
            self.refused += 1
            return
        if request is not None:
            packet = request.of(packet)
        self._deliver(message, packet, None)

    def _deliver(self, message: imc.Message, packet: bytes, origin: object) -> None:
        if self._backlog is not None:
            self._backlog.append((message, packet, origin))
            return
        self.delivered += 1
        own, kind = message.src == self.system, type(message)
        routes = self._of_own if own else self._of_others
        route = routes.get(kind)
        if route is None:
            heard = (s for s in self._route(kind) if own or s.others)
            route = routes[kind] = tuple((s.handler, s.owner, s.packets) for s in heard)
        enqueue = self.kernel.enqueue
        request = packet if isinstance(packet, Request) else None
        if request is not None:
            enqueue((request.handled, (True,)))
        for handler, owner, packets in route:
            if origin is None or owner is not origin:
                enqueue((handler, (message, packet) if packets else (message,)))
        if request is not None:
            enqueue((request.handled, (False,)))

    def _forget_routes(self) -> None:
        self._routes.clear()
        self._of_own.clear()
        self._of_others.clear()

    def _route(self, kind: type) -> tuple[Subscription, ...]:
        route = self._routes.get(kind)
        if route is None:
            route = tuple(s for s in self._subscriptions if issubclass(kind, s.type))
            self._routes[kind] = route
        return route
