"""Links between vehicles: messages of one arrive at the others late, in part, or not at all."""

import math
from collections import Counter, deque
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from zlib import crc32

import imc
from imc.coordinates import absolute_position
from runtime.kernel import SECOND
from runtime.vehicle import FleetError, Vehicle
from shoal.scenarios.run_context import RunContext
from support.wgs84 import displacement

QUEUE = 16  # messages
COUNTS = ("sent", "received", "lost", "out of range", "cut", "dropped")


@dataclass(frozen=True)
class LinkModel:
    """A link between the vehicles `ends`; all of them receive what one sends.

    `range` is the true distance in m beyond which nothing arrives. A message arrives after it was sent at `rate` (B/s),
    after `latency` (s), and after its way at `propagation` (m/s, of sound or light). `loss` is the probability that a
    receiver misses it. At a rate, each vehicle sends one message at a time; `queue` messages of it wait, and further
    ones are dropped. `messages` are the names of those that are sent, all if it is empty.
    """

    name: str
    ends: tuple[str, ...]
    range: float = math.inf
    latency: float = 0.0
    propagation: float = math.inf
    loss: float = 0.0
    rate: float = math.inf
    queue: int = QUEUE
    messages: tuple[str, ...] = ()

    @property
    def metric_names(self) -> dict[str, str]:
        """Counters, by the name of the metric."""
        return {f"{self.name}: {what}": what for what in COUNTS}

    def open_channel(self, context: RunContext) -> "LinkChannel":
        """Join the vehicles, before they start. Raises FleetError if two of them have the same IMC id."""
        return LinkChannel(self, {name: context.vehicles[name] for name in self.ends}, context.seed)


class LinkChannel:
    """A link in one run. `cuts` is how often it is cut at present.

    Counted are messages `sent`, and those that waited in vain and were `dropped`; of the sent ones, for each receiver,
    `received`, `lost`, `out of range` and `cut`. The rest was on its way at the end.
    A receiver gets each message at most once, in the order in which it was sent, and none of its own.
    """

    def __init__(self, link: LinkModel, vehicles: Mapping[str, Vehicle], seed: int):
        self.link = link
        self.cuts = 0
        self.counts: Counter[str] = Counter[str]()
        self.positions: dict[int, imc.SimulatedState] = {}
        self._seed = seed
        systems = [vehicle.system for vehicle in vehicles.values()]
        if len(set(systems)) < len(systems):
            raise FleetError(f"the link {link.name} joins vehicles with the same IMC id: change [IMC Addresses]")
        self.ends: list[LinkEndpoint] = [LinkEndpoint(self, name, vehicle) for name, vehicle in vehicles.items()]
        for end in self.ends:
            end.vehicle.bus.attach_transport(end)
            if math.isfinite(link.range) or math.isfinite(link.propagation):
                end.vehicle.observe(imc.SimulatedState, end.update_truth)

    def metrics(self) -> dict[str, float]:
        """The counts, with the name of the link."""
        return {name: float(self.counts[what]) for name, what in self.link.metric_names.items()}

    def distance(self, a: int, b: int) -> float:
        """The true distance (m) between two systems; infinite as long as one of them has no place."""
        here, there = self.positions.get(a), self.positions.get(b)
        if here is None or there is None:
            return math.inf
        if (here.lat, here.lon, here.height) == (there.lat, there.lon, there.height):
            return math.dist((here.x, here.y, here.z), (there.x, there.y, there.z))
        return math.hypot(*displacement(*absolute_position(here), *absolute_position(there)))

    def random_numbers(self, sender: str, receiver: str) -> Callable[[], float]:
        """Random numbers from 0 to 1 of one direction, which depend on nothing else in the run."""
        from numpy.random import PCG64, Generator, SeedSequence

        words = (crc32(word.encode()) for word in ("link", self.link.name, sender, receiver))
        return Generator(PCG64(SeedSequence([self._seed, *words]))).random


class LinkEndpoint:
    """The transport of one vehicle on a link."""

    transient = True

    def __init__(self, channel: LinkChannel, name: str, vehicle: Vehicle):
        self.name = name
        self.vehicle = vehicle
        self._channel = channel
        self._link = channel.link
        self._open = False
        self._waiting: deque[tuple[imc.Message, bytes]] = deque()
        self._sending = False

    @property
    def systems(self) -> Collection[int]:
        return self._others

    def open(self, receive: Callable[[bytes], None]) -> None:
        self._open = True

    def close(self) -> None:
        self._open = False
        self._waiting.clear()

    def update_truth(self, state: imc.SimulatedState) -> None:
        """Keep where the vehicle truly is; a place that is not finite is none."""
        if state.src != self.vehicle.system:
            return
        if math.isfinite(state.lat + state.lon + state.height + state.x + state.y + state.z):
            self._channel.positions[state.src] = state
        else:
            self._channel.positions.pop(state.src, None)

    def send(self, message: imc.Message, packet: bytes) -> None:
        wanted = self._link.messages
        if not self._open or (wanted and type(message).__name__ not in wanted) or message.src in self._others:
            return
        if math.isinf(self._link.rate):
            self._emit(message, packet)
        elif not self._sending:
            self._begin(message, packet)
        elif len(self._waiting) < self._link.queue:
            self._waiting.append((message, packet))
        else:
            self._channel.counts["dropped"] += 1

    @cached_property
    def _others(self) -> frozenset[int]:
        return frozenset(way.receiver.vehicle.system for way in self._paths)

    @cached_property
    def _paths(self) -> "list[_Path]":
        return [_Path(self._channel, self, other) for other in self._channel.ends if other is not self]

    def _begin(self, message: imc.Message, packet: bytes) -> None:
        self._sending = True
        self._later(len(packet) / self._link.rate, self._end, message, packet)

    def _end(self, message: imc.Message, packet: bytes) -> None:
        self._sending = False
        if not self._open:
            return
        self._emit(message, packet)
        if self._waiting:
            self._begin(*self._waiting.popleft())

    def _emit(self, message: imc.Message, packet: bytes) -> None:
        self._channel.counts["sent"] += 1
        for way in self._paths:
            way.transmit(message, packet)

    def _later(self, seconds: float, function: Callable[..., object], message: imc.Message, packet: bytes) -> None:
        self.vehicle.kernel.after(seconds, function, message, packet).owner = self.vehicle.bus

    def receive(self, message: imc.Message, packet: bytes) -> None:
        """Deliver what has arrived."""
        self._channel.counts["received" if self._open else "lost"] += 1
        if self._open:
            self.vehicle.bus.deliver(message, packet)


class _Path:
    """Route from one end to another."""

    def __init__(self, channel: LinkChannel, sender: LinkEndpoint, receiver: LinkEndpoint):
        self.receiver = receiver
        self._channel = channel
        self._sender = sender
        self._chance = channel.random_numbers(sender.name, receiver.name) if channel.link.loss else None
        self._latest = 0

    def transmit(self, message: imc.Message, packet: bytes) -> None:
        """Let a message arrive, after those before it, unless something is in the way."""
        link, counts, receiver = self._channel.link, self._channel.counts, self.receiver
        is_lost = self._chance is not None and self._chance() < link.loss
        delay = link.latency
        if self._channel.cuts:
            counts["cut"] += 1
            return
        if math.isfinite(link.range) or math.isfinite(link.propagation):
            distance = self._channel.distance(self._sender.vehicle.system, receiver.vehicle.system)
            if distance > link.range or math.isinf(distance):
                counts["out of range"] += 1
                return
            delay += distance / link.propagation
        if is_lost:
            counts["lost"] += 1
            return
        kernel, bus = receiver.vehicle.kernel, receiver.vehicle.bus
        if bus.messages is not self._sender.vehicle.bus.messages:
            message = bus.decode(packet)
        self._latest = max(self._latest, kernel.now_ns + round(delay * SECOND))
        kernel.at(self._latest, receiver.receive, message, packet).owner = bus
