"""A profile brought to life: kernel, bus, entities and tasks of one vehicle."""

import logging
import traceback
from collections.abc import Callable, Mapping
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import imc
from runtime.bus import Bus, Subscription
from runtime.devices import ScriptedInputs
from runtime.kernel import SECOND, Clock, Kernel, SimulatedCrash, owner_of, owner_title, to_ordinary_exception
from runtime.profile import default_label
from runtime.task import (
    Activation,
    EntityTable,
    State,
    SystemTable,
    Task,
    consumer_methods,
    format_exception_line,
    periodic_methods,
    rate_of,
    with_location,
)
from runtime.vehicle.daemon import Daemon
from runtime.vehicle.effective_config import EffectiveConfig, ProfileValues, set_parameter_texts, set_parameter_values
from runtime.vehicle.fleet import Fleet
from runtime.vehicle.other_process_entities import may_publish
from runtime.vehicle.realtime_lag import RealtimeLag
from runtime.vehicle.thread_pool import WorkerThreads
from support.backoff import Backoff

if TYPE_CHECKING:
    from runtime.snapshot import InputJournals

LONGEST_BACKOFF = 60.0
HEALTHY_AFTER = 60.0
STARTING_PATIENCE = 5.0  # s
WORK_PATIENCE = 0.3  # s, for offloaded work at the end of a run

T = TypeVar("T", bound=Task)

logger: logging.Logger = logging.getLogger("shoal.vehicle")


class Vehicle:
    """One vehicle: add tasks, `start`, `run`, `close`. It has its own kernel on `clock`, or shares that of a fleet.

    `keep_going` decides what an exception in a task does: True restarts the task with back-off, as on a vehicle; False
    ends the run, as in simulation, unless it is a SimulatedCrash. `profile` is the effective configuration,
    `state_folder` has the saved parameters, `messages` is the schema of its messages, by default the built-in one,
    `process` which of several processes of the vehicle this is, "" the main one, `running` the names of the tasks that
    are started and not stopped. The task that writes the log sets `keeps_log`, and `log_folder` once the log is there.
    `attribute_error` turns an exception of a task into the one that the run raises. `recordings` are what devices of
    tasks send in a test.
    """

    def __init__(
        self,
        name: str,
        system: int,
        *,
        clock: Clock | None = None,
        fleet: Fleet | None = None,
        profile: ProfileValues,
        systems: Mapping[str, int] | None = None,
        seed: int = 0,
        keep_going: bool = False,
        log_root: Path = Path("log"),
        state_folder: Path = Path("db"),
        bus: Callable[[Kernel, int], Bus] = Bus,
        entity_ids: Mapping[str, int] | None = None,
        messages: imc.Schema | None = None,
        process: str = "",
    ):
        self.name = name
        self.system = system
        self.process = process
        self.systems: SystemTable = SystemTable({**(systems or {}), name: system})
        self.profile = profile
        self.seed = seed
        self.keep_going = keep_going
        self.log_root = log_root
        self.log_folder: Path | None = None
        self.keeps_log = False
        self.recordings: ScriptedInputs | None = None
        self.state_folder = state_folder
        self.fleet = fleet
        if fleet is not None and clock is None:
            self.kernel: Kernel = fleet.kernel
        elif clock is not None and fleet is None:
            self.kernel = Kernel(clock)
            self.kernel.on_error, self.kernel.on_slow = self.on_task_error, self.on_slow
        else:
            raise TypeError("a vehicle has either a clock or a fleet")
        self.start_time: float = self.kernel.now_ns / SECOND
        self.bus: Bus = bus(self.kernel, system)
        if messages is not None:
            self.bus.set_schema(messages)
        self.entities: EntityTable = EntityTable(system, entity_ids)
        self.activations: dict[str, Activation] = {}
        self.exit_status: int = 0
        self._tasks: dict[str, Task] = {}
        self.effective_config: EffectiveConfig = EffectiveConfig(profile)
        self.running: set[str] = set()
        self.failures: dict[str, Backoff] = {}
        self._error: Exception | None = None
        self._is_reported = False
        self._starting = False
        self.journals: InputJournals | None = None
        self.attribute_error: Callable[[object, Exception], Exception] = lambda _, error: error
        self._observers: list[object] = []
        self.closing: bool = False
        self.stopped: bool = False
        self.realtime_lag: RealtimeLag | None = None if self.kernel.virtual else RealtimeLag(self)
        daemon = self.add(Daemon, "Daemon")
        assert isinstance(daemon, Daemon)
        self.daemon = daemon
        self.bus.accepts, self.bus.on_malformed = partial(may_publish, self), daemon.log_malformed
        if fleet is not None:
            fleet.join(self)

    @property
    def has_virtual_time(self) -> bool:
        """Whether time is virtual, so that no task may use the network."""
        return self.kernel.virtual

    @property
    def tasks(self) -> list[Task]:
        """All tasks, in the byte order of their sections."""
        return list(self._tasks.values())

    @cached_property
    def worker(self) -> WorkerThreads:
        """The threads for heavy work on a wall clock."""
        return WorkerThreads(self.name)

    def task(self, name: str) -> Task:
        """The task of a section. Raises KeyError."""
        return self._tasks[name]

    def task_by_label(self, label: str) -> Task | None:
        """The task whose main entity has this label."""
        return next((task for task in self._tasks.values() if task.entity.label == label), None)

    def add(self, cls: type[T], section: str, options: Mapping[str, str] | None = None, **values: Any) -> T:
        """Create a task: `options` are ini texts by ini name, `values` are values by attribute.

        Raises ParameterError for an invalid value, EntityError for its label.
        """
        options = dict(options or {})
        label = options.pop("Entity Label", "") or values.pop("entity_label", "") or default_label(section)
        entity = self.entities.reserve(label, section)
        try:
            task = cls(self, section, entity)
            task.entity_label = label
            set_parameter_texts(task, options)
            set_parameter_values(task, values)
            entity.activation_time, entity.deactivation_time = task.activation_time, task.deactivation_time
            task.configure()
            self.effective_config.set_baseline(task)
            for ticking in periodic_methods(cls):
                rate_of(task, ticking.rate)
        except BaseException:
            for reserved in [e for e in self.entities if e.component == section]:
                self.entities.release(reserved)
            raise
        self._tasks[section] = task
        if task.activation:
            self.activations[section] = Activation(task)
        return task

    def start(self) -> None:
        """Connect all tasks, then start them in order; what they publish meanwhile waits until all are started."""
        for task in self.tasks:
            task.subscribe_handlers()
        self._starting = True
        for task in self.tasks:
            self._soon(self._start, task)
        self.kernel.soon(self._started)

    def run(self, seconds: float | None = None) -> None:
        """Run for `seconds` of the vehicle's time, or until `stop`; in a fleet all vehicles run.

        Without `keep_going` it raises the exception of a handler.
        """
        if self.fleet is not None:
            self.fleet.run(seconds)
            return
        self.stopped = False
        begin = max(self.kernel.now_ns, self.kernel.clock.read())  # on a wall clock, time has passed since construction
        self.kernel.run(None if seconds is None else begin + round(seconds * SECOND))

    def stop(self, status: int = 0) -> None:
        """End the run with an exit status. In a fleet this vehicle is closed and the others continue."""
        self.exit_status = status
        self.stopped = True
        if not self.closing:
            self.kernel.stop()

    def close(self) -> None:
        """Stop all tasks, recorders of all messages last; deliver their last messages, and leave the bus.

        All tasks stop even if one fails. The first error is raised at the end, unless an error has ended the run before
        or `keep_going` is set.
        """
        self.closing = True
        recorders = [task for task in self.tasks if any(c.type is imc.Message for c in consumer_methods(type(task)))]
        try:
            self.kernel.drain()
            for task in [*(t for t in reversed(self.tasks) if t not in recorders), *recorders]:
                if task in recorders:
                    self.kernel.drain()
                self._shut(task)
            self.kernel.drain()
            self.bus.close_transports()
        finally:
            if "worker" in vars(self):
                for work in self.worker.close(WORK_PATIENCE):
                    logger.warning("%s is still running; it is abandoned", work)
            if self.fleet is None:
                self.kernel.close()
        try:
            if self._error is not None and not self._is_reported and not self.keep_going:
                self._is_reported = True
                raise self._error
        finally:
            if self.fleet is not None:
                self.fleet.leave(self)

    def has_callback_owner(self, owner: object) -> bool:
        """Whether a call belongs to the vehicle: `owner` is the vehicle, its bus, or a receiver of its bus."""
        return owner is self or owner is self.bus or self.bus.is_subscribed(owner)

    def observe(self, kind: type, handler: Callable[..., object], *, packets: bool = False) -> None:
        """Call `handler` with each delivered message of a type, from any system.

        Its owner only watches, and is not in snapshots. With a pending call it prevents them, unless it has a true
        attribute `transient`: then a continued run lacks it, or makes it again.
        """
        owner = owner_of(handler)
        if isinstance(owner, Task):
            raise TypeError(f"{owner!r} is part of the vehicle: use @consume or script.receive instead of observe")
        self._observers.append(owner)
        self.bus.subscribe(Subscription(kind, handler, handler, others=True, packets=packets))

    def has_observer(self, owner: object) -> bool:
        """Whether `owner` observes the bus; its state and its timers are not part of the vehicle."""
        return any(observer is owner for observer in self._observers)

    def update_effective_config(self, task: Task) -> None:
        """Take the task's changed parameters into the effective configuration."""
        self.effective_config.update_from_task(task)

    def save_parameters(self, task: Task) -> Path:
        """Save the parameters of a task that differ from the profile; returns the path. Raises OSError, ValueError."""
        path = self.state_folder / f"{self.name}-saved.ini"
        self.effective_config.save_changed_parameters(task, path)
        return path

    def _start(self, task: Task) -> None:
        self.running.add(task.name)
        activation = self.activations.get(task.name)
        if activation is not None and task.activation in ("plan", "maneuver"):
            task.parameter_set.set(task.parameters()["Active"], False)
        task.start()
        task.begin_ticking()
        if activation is not None and task.parameter_set.value(task.parameters()["Active"]):
            activation.request(True)

    def _soon(self, function: Callable[[Task], object], task: Task, delay: float = 0.0) -> None:
        """Call `function(task)` after a delay; an exception counts as one of the task."""
        self.kernel.after(delay, function, task).owner = task

    def _started(self) -> None:
        self._starting = False
        self.bus.release_backlog()

    def _restart(self, task: Task) -> None:
        before = (State.FAILURE, task.entity.description)
        task.subscribe_handlers()
        self._start(task)
        if (task.entity.state, task.entity.description) == before:
            task.set_entity_state(State.NORMAL, "restarted")

    def _shut(self, task: Task) -> None:
        try:
            task.cancel_callbacks()
        except BaseException as error:
            self._note(task, to_ordinary_exception(error))
        try:
            if task.name in self.running:
                self.running.discard(task.name)
                task.stop()
        except BaseException as error:
            self._note(task, to_ordinary_exception(error))
        finally:
            task.close_devices()

    def _note(self, owner: object, error: Exception) -> None:
        """Log an error of a task that stops, and keep the first one for `close`.

        One that a snapshot has caused is only raised by `close`, and reported by its caller.
        """
        blamed = self.attribute_error(owner, error)
        if blamed is error or self.keep_going:
            logger.error("%s while stopping: %s", owner_title(owner), with_location(error))
        self._error = self._error or blamed

    def on_task_error(self, owner: object, error: Exception) -> None:
        """Handle an exception of a handler: the kernel's `on_error`."""
        if self.closing or self.stopped:
            self._note(owner, error)
            return
        if not self.keep_going and not isinstance(error, SimulatedCrash):
            if error is not self._error:
                place = f"{self.name}, {owner_title(owner)}" if self.fleet is not None else owner_title(owner)
                error.add_note(f"in {place} at {self.kernel.now_ns / SECOND - self.start_time:.3f} s of the run")
            self._error, self._is_reported = self.attribute_error(owner, error), True
            raise self._error
        if not isinstance(owner, Task):
            logger.error("%s: %s", owner_title(owner), "".join(traceback.format_exception(error)))
            return
        self._shut(owner)
        if (activation := self.activations.get(owner.name)) is not None:
            activation.reset()
        backoff = self.failures.setdefault(owner.name, Backoff(1.0, LONGEST_BACKOFF, HEALTHY_AFTER))
        delay = backoff.fail(self.kernel.now_ns / SECOND)
        owner.set_entity_state(State.FAILURE, format_exception_line(error))
        owner.log.error(f"{with_location(error)}: restarting in {delay:g} s")
        self._soon(self._restart, owner, delay)

    def on_slow(self, owner: object, seconds: float, handler: str) -> None:
        """Name a task that delays the others: the kernel's `on_slow`. Tasks may take longer while they start.

        This is for developers: it stays on board, and operators do not get it.
        """
        if self._starting and seconds < STARTING_PATIENCE:
            return
        logger.warning(
            "%s: %s computed for %.3f s in one handler, %s; heavy work belongs in offload()",
            self.name,
            owner_title(owner),
            seconds,
            handler,
        )
