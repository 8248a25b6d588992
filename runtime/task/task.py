"""A task: one concern of a vehicle, with parameters, handlers and periodic methods."""

import functools
from collections.abc import Callable, Coroutine, Iterable
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar
from zlib import crc32

import imc
from runtime.bus import Subscription
from runtime.kernel import Readable, Timer, nanoseconds
from runtime.kernel.kernel import SECOND
from runtime.problem import Doubt
from runtime.task.entities import Entity, State
from runtime.task.handlers import Consumer, Ticker, consumers, tickers
from runtime.task.logbook import Logbook, cut
from runtime.task.parameter_set import ParameterSet
from runtime.task.parameters import Parameter, Scope, declared, param
from runtime.task.script import Script

if TYPE_CHECKING:
    from numpy.random import Generator

    from runtime.bus import Frame
    from runtime.vehicle import Vehicle

T = TypeVar("T")
UNKNOWN_SYSTEM = 0xFFFF
UNKNOWN_ENTITY = 0xFF
OPERATORS = range(0x4000, 0x6000)  # IMC ids of consoles


class Task:
    """One concern of a vehicle. Subclasses declare parameters, `@consume` and `@periodic` methods, and override hooks.

    The vehicle makes the instance, so a task keeps its own state in attributes that `configure` or `start` set.
    A class with `external` set talks to the outside and is left out of virtual runs; `requires` names the extra that
    has to be installed for it; `activation` is the scope of its parameter `Active`, empty for tasks without.
    `transient` names attributes that are no state and so in no snapshot: what `configure` or `restored` makes anew.
    Snapshots are taken in the midst of scripts where these are async methods of the task's own class.
    """

    external: ClassVar[bool] = False
    requires: ClassVar[str] = ""
    activation: ClassVar[Scope | str] = ""
    transient: ClassVar[tuple[str, ...]] = ()

    entity_label: str = param("", "", "Label of the task's entity.", editable=False)
    debug_level: str = param("None", "", "What goes to the log book.", choices=("None", "Debug", "Trace", "Spew"))
    execution_priority: int = param(10, "1", "Kept for DUNE's profiles; all tasks share one thread.", editable=False)
    activation_time: int = param(0, "s", "Time that activation takes.", minimum=0, maximum=65535, editable=False)
    deactivation_time: int = param(0, "s", "Time that deactivation takes.", minimum=0, maximum=65535, editable=False)
    loopback_internal_messages: bool = param(False, "", "Hear the messages of the task itself.", editable=False)

    def __init__(self, vehicle: "Vehicle", name: str, entity: Entity):
        self.vehicle = vehicle
        self.name = name
        self.entity = entity
        self.system = vehicle.system
        self.system_name = vehicle.name
        self.log = Logbook(self)
        self.parameter_set = ParameterSet(self, dict(self.parameters()))
        for parameter in self.parameter_set.declarations.values():
            value = parameter.default
            self.parameter_set.set(parameter, list(value) if parameter.is_list else value)
        self._kernel = vehicle.kernel
        self._bus = vehicle.bus
        self._tickers: list[Ticker] = []
        self._scripts: list[Script] = []
        self._round = 0

    def __repr__(self) -> str:
        return self.name

    @classmethod
    @functools.cache
    def parameters(cls) -> dict[str, Parameter]:
        """The declared parameters by ini name."""
        found = declared(cls)
        if cls.activation and "Active" not in found:
            raise TypeError(f"{cls.__name__}: activation needs `active: bool = param(..., scope={cls.activation!r})`")
        return found

    def configure(self) -> None:
        """The parameters have values, at load and after every change. Raise ParameterError where they make no sense."""

    def doubts(self) -> Iterable[Doubt]:
        """What is odd in the profile, with all tasks of the vehicle made, for `shoal check`."""
        return ()

    def start(self) -> None:
        """Acquire resources."""

    def stop(self) -> None:
        """Release them; called at the end, and before a restart."""

    def saving(self) -> None:
        """A snapshot is about to be taken: put into attributes what `restored` needs, and publish nothing."""

    def restored(self) -> None:
        """The state of a snapshot is back, in place of `start`: acquire resources, and publish nothing."""

    def activate(self) -> None:
        """The task is to become active; raise ActivationError where it cannot."""

    def deactivate(self) -> None:
        """The task is to become inactive; raise ActivationError where it cannot."""

    @property
    def now(self) -> float:
        """Seconds since 1970 UTC."""
        return self._kernel.now_ns / SECOND

    @property
    def now_ns(self) -> int:
        """Nanoseconds since 1970 UTC."""
        return self._kernel.now_ns

    @functools.cached_property
    def random(self) -> "Generator":
        """Random numbers of this task alone, from the vehicle's seed and the names of vehicle and task."""
        from numpy.random import PCG64, Generator, SeedSequence

        words = [self.vehicle.seed, crc32(self.system_name.encode()), crc32(self.name.encode())]
        return Generator(PCG64(SeedSequence(words)))

    def publish(self, message: imc.Message, *, keep_time: bool = False, entity: Entity | None = None) -> imc.Message:
        """Put a message on the bus: header filled, rounded to what the wire carries. Returns what receivers see.

        A source that the message names stays. Raises imc.EncodeError where a field does not fit its type.
        """
        packet = imc.encode_as(
            message,
            message.timestamp if keep_time else self._kernel.now_ns / SECOND,
            self.system if message.src == UNKNOWN_SYSTEM else message.src,
            (entity or self.entity).id if message.src_ent == UNKNOWN_ENTITY else message.src_ent,
            message.dst,
            message.dst_ent,
        )
        delivered = imc.decode(packet)
        self._bus.publish(delivered, packet, None if self.loopback_internal_messages else self)
        return delivered

    def reply(self, request: imc.Message, message: imc.Message, *, entity: Entity | None = None) -> imc.Message:
        """Publish `message` to the source of `request`."""
        return self.publish(message.replace(dst=request.src, dst_ent=request.src_ent), entity=entity)

    def concerns(self, request: imc.Message) -> bool:
        """Whether a request is for this system: addressed to it, or to nobody by itself or by an operator.

        What another vehicle asks of nobody in particular it asks of itself.
        """
        asks_itself = request.src == self.system or request.src in OPERATORS
        return request.dst == self.system or (request.dst == UNKNOWN_SYSTEM and asks_itself)

    def relay(self, packet: bytes) -> imc.Message:
        """Put somebody else's packet on the bus as it is, without what may follow it. Raises imc.DecodeError."""
        packet = imc.first_packet(packet)
        message = imc.decode(packet)
        self._bus.publish(message, packet, self)
        return message

    def share(self, frame: "Frame") -> None:
        """Give a frame to the tasks of this process that consume frames; it is not encoded, logged or sent."""
        self._bus.share(frame, self)

    def set_entity_state(self, state: State, description: str = "", *, entity: Entity | None = None) -> None:
        """Say how the entity is. A new state is published at once, a new description with the next report.

        A description is cut to 1023 bytes.
        """
        target = entity or self.entity
        changed = target.state is not state or not target.stateful
        target.state, target.description, target.stateful = state, cut(description), True
        if changed:
            self.publish(imc.EntityState(state=state, description=target.description), entity=target)

    def reserve(self, label: str) -> Entity:
        """A further entity of this task; call it in `configure`. The same label gives the same entity again."""
        found = self.vehicle.entities.find(label)
        if found is not None and found.component == self.name:
            return found
        return self.vehicle.entities.reserve(label, self.name)

    def after(self, seconds: float, function: Callable[..., object], *args: Any) -> Timer:
        """Call `function` in so many seconds."""
        return self._owned(self._kernel.after(seconds, function, *args))

    def at(self, time: float, function: Callable[..., object], *args: Any) -> Timer:
        """Call `function` at a time (s since 1970 UTC)."""
        return self._owned(self._kernel.at(nanoseconds(time), function, *args))

    def watch(self, source: Readable, function: Callable[[], object]) -> None:
        """Call `function` whenever a socket has something to read, until the task stops."""
        self._owned(self._kernel.watch(source, function))

    def unwatch(self, source: Readable) -> None:
        """End `watch`."""
        self._kernel.unwatch(source)

    def offload(
        self, function: Callable[..., T], *args: Any, then: Callable[[T], object], latency: float = 0.0
    ) -> None:
        """Compute `function(*args)` away from the handlers and give the result to `then`.

        A worker thread does it on a wall clock. On a virtual clock it is computed at once and the result arrives after
        `latency` seconds, so the run stays deterministic. What the function raises is raised as the task's own error.
        """
        if self._kernel.virtual:
            self.after(latency, self._offloaded, self._round, then, _outcome(function, args))
        else:
            deliver = functools.partial(self._kernel.post, self._offloaded, self._round, then)
            future = self.vehicle.worker.submit(_outcome, function, args)
            future.add_done_callback(lambda done: done.cancelled() or deliver(done.result()))

    def run(self, coroutine_function: Callable[..., Coroutine[Any, Any, Any]], *args: Any) -> Script:
        """Start `coroutine_function(script, *args)` as sequential logic on the same kernel."""
        script = Script(self, self._bus, coroutine_function, *args)
        self._scripts = [*(s for s in self._scripts if not s.done), script]
        return script

    @property
    def tickers(self) -> list[Ticker]:
        """The periodic methods that run."""
        return self._tickers

    @property
    def running_scripts(self) -> list[Script]:
        """The scripts that run."""
        return [script for script in self._scripts if not script.done]

    def connect(self) -> None:
        """Begin to hear; the vehicle calls it before `start`."""
        for consumer in consumers(type(self)):
            self._bus.subscribe(self._subscription(consumer))

    def begin_ticking(self) -> None:
        """Begin to tick; the vehicle calls it after `start`."""
        self._tickers = [Ticker(self, ticking) for ticking in tickers(type(self))]

    def disconnect(self) -> None:
        """Forget subscriptions, timers, ticks, watched sockets and what is still on its way."""
        self._round += 1
        self._bus.unsubscribe(self)
        for ticker in self._tickers:
            ticker.stop()
        scripts, self._tickers, self._scripts = self._scripts, [], []
        with ExitStack() as stack:  # one script that fails to end does not keep the others
            stack.callback(self._kernel.discard, self)
            for script in scripts:
                stack.callback(script.cancel)

    def reconfigured(self) -> None:
        """Follow changed rates."""
        if self._bus.witness is not None:
            self._bus.witness.reconfigured(self)
        for ticker in self._tickers:
            ticker.update()

    def _subscription(self, consumer: Consumer) -> Subscription:
        return Subscription(consumer.type, getattr(self, consumer.method), self, consumer.others, consumer.packets)

    def _owned(self, timer: Timer) -> Timer:
        timer.owner = self
        return timer

    def _offloaded(self, began: int, then: Callable[[Any], object], outcome: tuple[Any, Exception | None]) -> None:
        if began != self._round:
            return
        result, error = outcome
        if error is not None:
            raise error
        then(result)


def _outcome(function: Callable[..., Any], args: tuple[Any, ...]) -> tuple[Any, Exception | None]:
    try:
        return function(*args), None
    except Exception as error:
        return None, error
