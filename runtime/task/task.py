"""A task: one concern of a vehicle, with parameters, handlers and periodic methods."""

import functools
from collections.abc import Callable, Coroutine, Iterable, Mapping
from contextlib import ExitStack
from threading import Thread
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar
from zlib import crc32

import imc
from imc.reserved_ids import BROADCAST, OPERATORS, UNKNOWN_ENTITY, UNKNOWN_SYSTEM
from runtime.bus import Subscription
from runtime.kernel import SECOND, Readable, Timer, handler_name, nanoseconds, to_ordinary_exception
from runtime.task.decorators import ConsumerMethod, Ticker, consumer_methods, periodic_methods
from runtime.task.devices import DeviceTask
from runtime.task.entity_system_tables import Entity, State
from runtime.task.logbook import Logbook, truncate_utf8
from runtime.task.parameter_set import ParameterSet
from runtime.task.parameters import Parameter, Scope, SharedOption, declared_parameters, param
from runtime.task.script import Script
from support.diagnostics import ConfigWarning

if TYPE_CHECKING:
    from numpy.random import Generator

    from runtime.bus import Frame
    from runtime.vehicle import Vehicle

T = TypeVar("T")


class Task(DeviceTask):
    """One concern of a vehicle. Subclasses declare parameters, `@consume` and `@periodic` methods, and override hooks.

    The vehicle makes the instance, so a task keeps its own state in attributes that `configure` or `start` set.
    A class with `external` set needs the network or a device and is skipped in virtual time; `requires` names the extra
    that it needs, without which a vehicle does not start, unless the class is `optional`; `activation` is the scope of
    its parameter `Active`, empty for tasks without.
    `transient` names attributes that are not in snapshots, because `configure` or `after_restore` makes them again.
    `reads` has the options of sections that several tasks read, each with unit and meaning; a name that ends with /
    stands for all sections that begin with it.
    A snapshot can contain a running script if it is an async method of the task's own class.
    """

    external: ClassVar[bool] = False
    requires: ClassVar[str] = ""
    optional: ClassVar[bool] = False
    activation: ClassVar[Scope | str] = ""
    transient: ClassVar[tuple[str, ...]] = ()
    reads: ClassVar[Mapping[str, Mapping[str, SharedOption]]] = MappingProxyType({})

    entity_label: str = param("", "", "Label of the task's entity.", editable=False)
    debug_level: str = param("None", "", "Verbosity of the log book.", choices=("None", "Debug", "Trace", "Spew"))
    execution_priority: int = param(10, "1", "No effect: all tasks share one thread.", editable=False)
    activation_time: int = param(0, "s", "Time that activation takes.", minimum=0, maximum=65535, editable=False)
    deactivation_time: int = param(0, "s", "Time that deactivation takes.", minimum=0, maximum=65535, editable=False)
    loopback_internal_messages: bool = param(False, "", "Receive the task's own messages.", editable=False)

    def __init__(self, vehicle: "Vehicle", name: str, entity: Entity):
        self.vehicle = vehicle
        self.name = name
        self.entity = entity
        self.system: int = vehicle.system
        self.system_name: str = vehicle.name
        self.log: Logbook = Logbook(self)
        self.parameter_set: ParameterSet = ParameterSet(self, dict(self.parameters()))
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
        found = declared_parameters(cls)
        if cls.activation and "Active" not in found:
            raise TypeError(f"{cls.__name__}: activation needs `active: bool = param(..., scope={cls.activation!r})`")
        return found

    def configure(self) -> None:
        """Called with new parameter values, at load and after every change. Raise ParameterError to reject them."""

    def configuration_warnings(self) -> Iterable[ConfigWarning]:
        """Oddities in the profile, for `shoal check`; called when all tasks of the vehicle are made."""
        return ()

    def start(self) -> None:
        """Acquire resources."""

    def stop(self) -> None:
        """Release resources; called at the end, and before a restart."""

    def before_snapshot(self) -> None:
        """Called before a snapshot: put what `after_restore` needs into attributes. Do not publish."""

    def after_restore(self) -> None:
        """Called instead of `start` after the state of a snapshot is back: acquire resources. Do not publish."""

    def activate(self) -> None:
        """Become active; raise ActivationError if that is not possible."""

    def deactivate(self) -> None:
        """Become inactive; raise ActivationError if that is not possible."""

    @property
    def now(self) -> float:
        """Seconds since 1970 UTC."""
        return self._kernel.now

    @property
    def now_ns(self) -> int:
        """Nanoseconds since 1970 UTC."""
        return self._kernel.now_ns

    def age(self, time: float) -> float:
        """Seconds since `time` (s since 1970 UTC) in which the process ran: how long something has really been silent.

        While the process stands still it receives nothing, so this does not count. On a virtual clock that never
        happens, and it is `now - time`.
        """
        kernel = self._kernel
        if not kernel.stalls.total:
            return kernel.now - time
        return kernel.now - time - kernel.stalls.left_out_since(time * SECOND) / SECOND

    @property
    def recent_stall(self) -> float:
        """Time (s) that the process stood still until less than a second ago, else 0.

        Then a first sample may be older than it seems, and contains nothing of what happened since the one before.
        """
        stalls = self._kernel.stalls
        return stalls.recent(self._kernel.now_ns) / SECOND if stalls.total else 0.0

    @property
    def now_without_stalls(self) -> float:
        """`now` less the times in which the process stood still: a clock for checks that take the time.

        Where one stall follows the other, up to 0.5 s of each count, else a silence would hardly age.
        """
        kernel = self._kernel
        return kernel.now - kernel.stalls.left_out / SECOND if kernel.stalls.total else kernel.now

    @functools.cached_property
    def random(self) -> "Generator":
        """This task's own random numbers, seeded with the vehicle's seed and the names of vehicle and task."""
        from numpy.random import PCG64, Generator, SeedSequence

        words = [self.vehicle.seed, crc32(self.system_name.encode()), crc32(self.name.encode())]
        return Generator(PCG64(SeedSequence(words)))

    def publish(self, message: imc.Message, *, keep_time: bool = False, entity: Entity | None = None) -> imc.Message:
        """Put a message on the bus: header filled, values rounded as in a packet. Returns what receivers see.

        A source set in the message is kept. Raises TypeError if it is no message, imc.EncodeError if a field does
        not fit its type, imc.SchemaError if the vehicle has no such message.
        """
        try:
            timestamp, source, speaker = message.timestamp, message.src, message.src_ent
            if not keep_time:
                timestamp = self._kernel.now
            if source == UNKNOWN_SYSTEM:
                source = self.system
            if speaker == UNKNOWN_ENTITY:
                speaker = (entity or self.entity).id
            origin = None if self.loopback_internal_messages else self
            return self._bus.publish(message, timestamp, source, speaker, origin)
        except Exception:
            _refuse(message)
            raise

    def reply(self, request: imc.Message, message: imc.Message, *, entity: Entity | None = None) -> imc.Message:
        """Publish `message` to the source of `request`."""
        return self.publish(message.replace(dst=request.src, dst_ent=request.src_ent), entity=entity)

    def is_reply_to_me(self, reply: imc.Message) -> bool:
        """Whether a reply is to this task. Others on board number their requests in the same way."""
        return (reply.dst, reply.dst_ent) == (self.system, self.entity.id)

    def is_for_me(self, request: imc.Message) -> bool:
        """Whether a request is for this system: addressed to it, or to everybody and sent by itself or a console.

        A request that another vehicle sends to everybody is meant for that vehicle.
        """
        asks = request.src == self.system or request.src in OPERATORS
        return request.dst == self.system or (request.dst in (UNKNOWN_SYSTEM, BROADCAST) and asks)

    def is_addressed_or_broadcast(self, message: imc.Message) -> bool:
        """Whether a message from any system is to this one or to all; for what must not be missed."""
        return message.dst in (self.system, UNKNOWN_SYSTEM, BROADCAST)

    def relay(self, packet: bytes) -> imc.Message:
        """Put another system's packet on the bus unchanged, without bytes after it. Raises imc.DecodeError."""
        message, packet = self._bus.decode_first(packet)
        self._bus.deliver_and_send(message, packet, self)
        return message

    def publish_frame(self, frame: "Frame") -> None:
        """Give a frame to the tasks of this process that consume frames; it is not encoded, logged or sent."""
        self._bus.publish_frame(frame, self)

    def set_entity_state(self, state: State, description: str = "", *, entity: Entity | None = None) -> None:
        """Set the entity's state. A new state is published immediately, a new description with the next report.

        A description is cut to 1023 bytes.
        """
        target = entity or self.entity
        changed = target.state is not state or not target.stateful
        target.state, target.description, target.stateful = state, truncate_utf8(description), True
        if changed:
            self.publish(imc.EntityState(state=state, description=target.description), entity=target)

    def reserve_entity(self, label: str) -> Entity:
        """Reserve another entity for this task; call it in `configure`. The same label returns the same entity."""
        found = self.vehicle.entities.find(label)
        if found is not None and found.component == self.name:
            return found
        return self.vehicle.entities.reserve(label, self.name)

    def is_from(self, message: imc.Message, label: str) -> bool:
        """Whether a message comes from the entity of a label; an empty label accepts all."""
        return not label or self.vehicle.entities.label(message.src, message.src_ent) == label

    def after(self, seconds: float, function: Callable[..., object], *args: Any) -> Timer:
        """Call `function` after `seconds`."""
        return self._owned(self._kernel.after(seconds, function, *args))

    def at(self, time: float, function: Callable[..., object], *args: Any) -> Timer:
        """Call `function` at a time (s since 1970 UTC)."""
        return self._owned(self._kernel.at(nanoseconds(time), function, *args))

    def watch(self, source: Readable, function: Callable[[], object]) -> None:
        """Call `function` whenever a socket has something to read, until the task stops."""
        self._owned(self._kernel.watch(source, function))

    def unwatch(self, source: Readable) -> None:
        """Stop watching a socket."""
        self._kernel.unwatch(source)

    def offload(
        self, function: Callable[..., T], *args: Any, then: Callable[[T], object], latency: float = 0.0
    ) -> None:
        """Compute `function(*args)` outside the handlers and pass the result to `then`.

        On a wall clock a worker thread computes it. On a virtual clock it is computed immediately and the result
        arrives after `latency` seconds, so the run stays deterministic. An exception in it is the task's error. At the
        end of a run, unfinished work is given up.
        """
        if self._kernel.virtual:
            self.after(latency, self._offloaded, self._round, then, _outcome(function, args))
        else:
            deliver = functools.partial(self._kernel.post, self._offloaded, self._round, then)
            title = f"{handler_name(function)} of {self.name}"
            self.vehicle.worker.submit(title, lambda: deliver(_outcome(function, args)))

    def run_in_thread(self, function: Callable[[], object]) -> None:
        """Call `function`, the loop of a library, in a thread of its own, which enters the kernel by `post` only.

        It has to return when the task stops. An exception in it is the task's error. Not for virtual time.
        """
        deliver = functools.partial(self._kernel.post, self._offloaded, self._round, _ignore)
        Thread(target=lambda: deliver(_outcome(function, ())), name=self.name, daemon=True).start()

    def start_script(self, coroutine_function: Callable[..., Coroutine[Any, Any, Any]], *args: Any) -> Script:
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

    def subscribe_handlers(self) -> None:
        """Subscribe the handlers; the vehicle calls it before `start`."""
        for consumer in consumer_methods(type(self)):
            self._bus.subscribe(self._subscription(consumer))

    def begin_ticking(self) -> None:
        """Start the periodic methods; the vehicle calls it after `start`."""
        self._tickers = [Ticker(self, ticking) for ticking in periodic_methods(type(self))]

    def cancel_callbacks(self) -> None:
        """Drop subscriptions, timers, ticks, scripts, watched sockets and results not yet delivered."""
        self._round += 1
        self._bus.unsubscribe(self)
        for ticker in self._tickers:
            ticker.stop()
        scripts, self._tickers, self._scripts = self._scripts, [], []
        with ExitStack() as stack:  # all scripts are canceled even if one fails
            stack.callback(self._kernel.cancel_owner, self)
            for script in scripts:
                stack.callback(script.cancel)

    def update_rates(self) -> None:
        """Apply changed rates."""
        for instrument in self._bus.observers:
            instrument.on_reconfigure(self)
        for ticker in self._tickers:
            ticker.update_rate()

    def _subscription(self, consumer: ConsumerMethod) -> Subscription:
        return Subscription(consumer.type, getattr(self, consumer.method), self, consumer.others, consumer.packets)

    def _owned(self, timer: Timer) -> Timer:
        timer.owner = self
        return timer

    def _offloaded(self, began: int, then: Callable[[Any], object], outcome: tuple[Any, Exception | None]) -> None:
        if began != self._round:  # requested before a restart
            return
        result, error = outcome
        if error is not None:
            raise error
        then(result)


def _refuse(message: object) -> None:
    """Raise the error with the reason why something cannot be published: no message, or a field that does not fit."""
    if not isinstance(message, imc.Message):
        raise TypeError(f"publish takes a message, such as imc.Depth(value=1.0), not {message!r}") from None
    imc.encode(message)


def _outcome(function: Callable[..., Any], args: tuple[Any, ...]) -> tuple[Any, Exception | None]:
    try:
        return function(*args), None
    except BaseException as error:
        return None, to_ordinary_exception(error)


def _ignore(_: object) -> None:
    """Take the result of a thread that has ended."""
