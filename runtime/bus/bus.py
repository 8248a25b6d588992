"""Delivers each published message to the subscribers of its type, in order of publication, never re-entrantly."""

import logging
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import NamedTuple

import imc
from imc.layout import SMALLEST_PACKET
from imc.reserved_ids import UNKNOWN_SYSTEM
from runtime.bus.camera_frame import Frame, FrameTransport
from runtime.bus.codec_roundtrip import CodecRoundTrip, find_equivalent_class
from runtime.bus.interfaces import BusObserver, Handler, Subscription, Transport
from runtime.bus.packet_inbox import PacketInbox, Request
from runtime.kernel import Kernel, owner_of

AT_ONCE = 64  # packets from other processes taken at a time; then the vehicle's own timers come first
BYTES_AT_ONCE = 1 << 14  # of them, after which the timers come first even if there were fewer packets

logger: logging.Logger = logging.getLogger("shoal.bus")

Receivers = tuple[tuple[Handler, bool], ...]  # handler, whether it takes the packet, too


class _Plan(NamedTuple):
    """The receivers of a type of messages, whether they need its packets, and whether they are the only ones.

    What one of their owners publishes goes to the others only: `of_owner`.
    """

    receivers: Receivers
    of_owner: dict[object, Receivers]
    encodes: bool
    direct: bool


class Bus:
    """The in-process bus of one vehicle, whose IMC id is `system`.

    Until `release_backlog` it keeps what is published, so that no task misses what others publish while they start.
    All that is delivered has been through the codec: a receiver here gets the same values as one elsewhere.
    Frames are not messages: they are shared between the tasks of this process, and `frames`, if there is one, carries
    them to other processes of the vehicle.
    What other processes send waits in `inbox`, and gets at most half of the time of a wall clock while the vehicle has
    work to do.
    `accepts` decides on each message of this vehicle that another process has sent. `on_malformed` gets
    the system that has sent what cannot be read, and the reason.
    Counted: `delivered`; of the packets from other processes `malformed`, `refused` by `accepts`, and `inbox.dropped`
    if they arrive too fast.
    """

    needs_packets = False
    """Whether packets of published messages are wanted even if no handler takes them."""

    def __init__(self, kernel: Kernel, system: int):
        self.kernel = kernel
        self.system = system
        self.set_schema(imc.builtin())
        self.delivered: int = 0
        self.observers: list[BusObserver] = []
        self.malformed: int = 0
        self.refused: int = 0
        self.accepts: Callable[[imc.Message], bool] = lambda _: True
        self.on_malformed: Callable[[int, str], object] = lambda _, __: None
        self.inbox: PacketInbox = PacketInbox()
        self.frames: FrameTransport | None = None
        self._shown: dict[str, Frame] = {}
        self._subscriptions: list[Subscription] = []
        self._routes: dict[type, tuple[Subscription, ...]] = {}
        self._of_own: dict[type, _Plan] = {}
        self._of_others: dict[type, _Plan] = {}
        self._transports: list[Transport] = []
        self._backlog: list[tuple[imc.Message, bytes, object]] | None = []

    def set_schema(self, schema: imc.Schema) -> None:
        """Carry the messages of this schema, instead of the built-in one."""
        self.messages = schema
        codec = schema.codec
        self.decode: Callable[[bytes], imc.Message] = codec.decode
        self.decode_first: Callable[[bytes], tuple[imc.Message, bytes]] = codec.decode_first
        self._encoding, self._rounding = CodecRoundTrip(schema, encodes=True), CodecRoundTrip(schema, encodes=False)

    def release_backlog(self) -> None:
        """Deliver what has been kept, and from now on everything immediately."""
        kept = self._backlog or []
        self.discard_backlog()
        for message, packet, origin in kept:
            self._deliver(message, packet, origin)

    def discard_backlog(self) -> None:
        """Drop what has been kept, and deliver everything from now on."""
        self._backlog = None
        self._forget_plans()

    @property
    def subscriptions(self) -> list[Subscription]:
        """All subscriptions, in the order in which they are served."""
        return list(self._subscriptions)

    def set_subscriptions(self, subscriptions: Iterable[Subscription]) -> None:
        """Serve exactly these subscriptions, in this order."""
        self._subscriptions = list(subscriptions)
        self._forget_routes()

    def is_subscribed(self, owner: object) -> bool:
        """Whether `owner` or one of its methods receives messages."""
        return any(s.owner is owner or owner_of(s.handler) is owner for s in self._subscriptions)

    def subscribe(self, subscription: Subscription) -> None:
        subscription = self._translated(subscription)
        for instrument in self.observers:
            instrument.on_subscribe(subscription)
        self._subscriptions.append(subscription)
        self._forget_routes(subscription.type)
        if self.frames is not None and issubclass(Frame, subscription.type):
            self.frames.subscribe(self._take_frame)

    def _translated(self, subscription: Subscription) -> Subscription:
        """Subscription to the class that this bus delivers; a subscriber may have own definitions of the message."""
        kind = subscription.type
        _check_class(kind)
        if not issubclass(kind, imc.Message) or kind.SCHEMA is None or kind.SCHEMA is self.messages:
            return subscription
        return replace(subscription, type=find_equivalent_class(kind, self.messages))

    def unsubscribe(self, owner: object) -> None:
        """Drop all subscriptions of `owner`."""
        self._subscriptions = [s for s in self._subscriptions if s.owner is not owner]
        self._forget_routes()

    def remove_subscription(self, subscription: Subscription) -> None:
        self._subscriptions = [s for s in self._subscriptions if s is not subscription]
        self._forget_routes(subscription.type)

    def publish(self, message: imc.Message, timestamp: float, source: int, speaker: int, origin: object) -> imc.Message:
        """Publish `message` with this header, as its packet has it; returns what receivers see.

        It is encoded only if a receiver needs the packet: handlers alone get the same values without. Raises
        imc.SchemaError if the vehicle has no such message, and anything for values that do not fit (see imc.encode).
        """
        kind = type(message)
        plans = self._of_own if source == self.system else self._of_others
        receivers, of_owner, encodes, direct = plans.get(kind) or self._plan(kind, source == self.system)
        packet = b""
        if encodes:
            seen, packet = self._encoding[kind](message, timestamp, source, speaker, message.dst, message.dst_ent)
        else:
            seen = self._rounding[kind](message, timestamp, source, speaker, message.dst, message.dst_ent)
        if not direct:
            self.deliver_and_send(seen, packet, origin)
            return seen
        self.delivered += 1
        if origin in of_owner:
            receivers = of_owner[origin]
        enqueue, alone = self.kernel.enqueue, (seen,)
        for handler, packets in receivers:
            enqueue((handler, (seen, packet) if packets else alone))
        return seen

    def deliver_and_send(self, message: imc.Message, packet: bytes, origin: object) -> None:
        """Deliver `message`, which `packet` decodes to, to all but `origin`, and send it on all transports."""
        self._deliver(message, packet, origin)
        for transport in self._transports:
            transport.send(message, packet)

    def publish_frame(self, frame: object, origin: object) -> None:
        """Deliver a frame to the tasks of this process, and to other processes of the vehicle."""
        self._show(frame, origin)
        if self.frames is not None and isinstance(frame, Frame):
            self.frames.send(frame)

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

    def deliver(self, message: imc.Message, packet: bytes) -> None:
        """Deliver a message from another bus of this process."""
        self._deliver(message, packet, None)

    @property
    def has_transports(self) -> bool:
        """Whether any transport carries what is published."""
        return bool(self._transports)

    def is_system_on_transport(self, system: int) -> bool:
        """Whether another system is on the buses that transports join, so that its packets come from there."""
        return any(system in transport.systems for transport in self._transports)

    def attach_transport(self, transport: Transport) -> None:
        """Join the buses that `transport` reaches; transports attached earlier stay.

        Raises what `transport.open` raises; the bus is then as before.
        """
        transport.open(self._take)
        self._transports.append(transport)
        self._forget_plans()

    def close_transports(self) -> None:
        """Close all transports, the last one first. All are closed even if one fails; the first error is raised."""
        errors: list[Exception] = []
        self._forget_plans()
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
        packets = (
            self.inbox.take_packets(len(self.inbox))
            if self.kernel.virtual
            else self.inbox.take_packets(AT_ONCE, BYTES_AT_ONCE)
        )
        for packet in packets:
            self._receive(packet)
        self.kernel.soon(self._continue_serving, began)

    def _continue_serving(self, began: float) -> None:
        if not self.inbox.has_more():
            return
        if self.kernel.virtual:
            self.kernel.post(self._serve)
        else:
            # A pause as long as the work before: under load half of the thread is for tasks.
            self.kernel.after_or_idle((time.perf_counter() - began) * self.kernel.clock.speed, self._serve)

    def _receive(self, packet: bytes) -> None:
        if not self._transports:
            return
        request = packet if isinstance(packet, Request) else None
        try:
            message, packet = self.decode_first(packet)
        except imc.DecodeError as error:
            self.malformed += 1
            self.on_malformed(
                imc.packet_source(packet) if len(packet) >= SMALLEST_PACKET else UNKNOWN_SYSTEM, error.reason
            )
            return
        if message.src == self.system and not self.accepts(message):
            self.refused += 1
            return
        if request is not None:
            packet = request.with_packet(packet)
        self._deliver(message, packet, None)

    def _deliver(self, message: imc.Message, packet: bytes, origin: object) -> None:
        if self._backlog is not None:
            self._backlog.append((message, packet, origin))
            return
        own, kind = message.src == self.system, type(message)
        plan = (self._of_own if own else self._of_others).get(kind) or self._plan(kind, own)
        request = packet if isinstance(packet, Request) else None
        if request is not None:
            self.kernel.soon(request.handled, True)
        self._enqueue(plan.of_owner.get(origin, plan.receivers), message, packet)
        if request is not None:
            self.kernel.soon(request.handled, False)

    def _enqueue(self, receivers: Receivers, message: imc.Message, packet: bytes) -> None:
        self.delivered += 1
        enqueue, alone = self.kernel.enqueue, (message,)
        for handler, packets in receivers:
            enqueue((handler, (message, packet) if packets else alone))

    def _plan(self, kind: type[imc.Message], own: bool) -> _Plan:
        receivers = [s for s in self._route(kind) if own or s.others]
        owners = dict.fromkeys(s.owner for s in receivers if s.owner is not None)
        busy = self._transports or self.needs_packets or self._backlog is not None
        # Else receivers are those of the class that it becomes.
        direct = not busy and self.messages.codec.has_message_class(kind)
        plan = (self._of_own if own else self._of_others)[kind] = _Plan(
            tuple((s.handler, s.packets) for s in receivers),
            {owner: tuple((s.handler, s.packets) for s in receivers if s.owner is not owner) for owner in owners},
            not direct or any(s.packets for s in receivers),
            direct,
        )
        return plan

    def _forget_routes(self, kind: type = object) -> None:
        """Forget who receives a type, and those derived from it: scripts subscribe whenever they wait."""
        for known in [known for known in self._routes if issubclass(known, kind)]:
            for forgotten in (self._routes, self._of_own, self._of_others):
                forgotten.pop(known, None)

    def _forget_plans(self) -> None:
        self._of_own.clear()
        self._of_others.clear()

    def _route(self, kind: type) -> tuple[Subscription, ...]:
        route = self._routes.get(kind)
        if route is None:
            route = tuple(s for s in self._subscriptions if issubclass(kind, s.type))
            self._routes[kind] = route
        return route


def _check_class(kind: object) -> None:
    if not isinstance(kind, type):
        raise TypeError(f"expected the class of a message, such as imc.GpsFix, not {kind!r}")
