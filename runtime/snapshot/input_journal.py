"""Records the inputs of tasks with scripts, so that a snapshot can replay them."""

import inspect
import zlib
from collections.abc import Callable
from types import MethodType
from typing import Any

import msgspec

import imc
from runtime.bus import Subscription
from runtime.kernel import Timer, owner_of
from runtime.snapshot.allowlist import LARGEST, SnapshotError, check_msgpack_size
from runtime.snapshot.task_state import (
    TaskState,
    TimerState,
    entities_of,
    subscription_task,
    task_state,
    timer_state,
    writer_for,
)
from runtime.task import Task
from runtime.vehicle import Vehicle

MANY = 256  # entries after which a journal is packed, or begins again if no script runs
TIMER, CHANGED, SET, EARLY, QUEUED = "", "!changed", "!set", "!early", "!queued"
"""Entries without a method: the next due timer; parameters changed with `on_reconfigure`; parameters only set; a moment
begins whose timers are not queued yet, since a message came between two runs; they are queued now."""

JournalEntry = tuple[int, int | str, tuple[Any, ...]]
PlainJournalEntry = tuple[int, int | str, list[Any]]
TaskValues = tuple[dict[str, Any], list[dict[str, Any]], bool]


class JournalStart(msgspec.Struct, array_like=True):
    """The state of a task at a time (ns) when it ran no script, and its inputs since then.

    entities: label, state, description, and whether the task has reported the state. checksum: that of the task when
    the snapshot was taken, which the replay has to reach.
    """

    time: int
    state: TaskState
    timers: list[TimerState]
    entities: list[tuple[str, int, str, bool]]
    chunks: list[bytes]
    checksum: int = 0


class JournalChunk(msgspec.Struct, array_like=True):
    """Entries: time (ns), method or number of the handler, arguments. A message is an index into `packets`."""

    packets: list[bytes]
    entries: list[PlainJournalEntry]


class InputJournal:
    """The state of one task at its last recorded moment without a script, and its inputs since then.

    A waiting coroutine cannot be saved as plain values. A task with a running script is therefore saved as this earlier
    state, and the replay of its inputs brings the coroutine to the same line.
    """

    def __init__(self, task: Task):
        self.task = task
        self.past: JournalStart | None = None
        self.trouble: str = "it has not started"
        self.begun: bool = False
        self.entries: list[JournalEntry] = []
        self.handlers: list[Callable[..., object]] = []
        self.values: TaskValues = _values(task)

    def restart_journal(self, time: int, subscriptions: list[Subscription], timers: list[Timer]) -> None:
        """Begin again with the present state, in which no script runs."""
        self.begun = True
        self.entries.clear()
        self.handlers = [subscription.handler for subscription in subscriptions]
        self.values = _values(self.task)
        writer = writer_for(self.task.vehicle, timers)
        try:
            self.past = JournalStart(
                time,
                task_state(self.task, subscriptions, writer),
                [timer_state(timer, writer) for timer in timers],
                [(e.label, e.state, e.description, e.stateful) for e in entities_of(self.task)],
                [],
            )
        except SnapshotError as error:
            self.invalidate(str(error))

    def pack(self) -> None:
        """Compress the entries."""
        try:
            if self.past is not None and self.entries:
                self.past.chunks.append(self._packed())
        except SnapshotError as error:
            self.invalidate(str(error))
        self.entries.clear()

    def invalidate(self, why: str) -> None:
        """Make the journal unusable until it begins again."""
        self.past, self.trouble = None, why

    def snapshot(self, checksum: int) -> JournalStart:
        """The journal up to now, with the present checksum of the task. Raises SnapshotError."""
        past = self.past
        if past is None:
            raise SnapshotError(f"{self.task.name} runs a script, and its journal was lost: {self.trouble}")
        chunks = [*past.chunks, self._packed()] if self.entries else list(past.chunks)
        return JournalStart(past.time, past.state, past.timers, past.entities, chunks, checksum)

    def _packed(self) -> bytes:
        packets: list[bytes] = []
        places: dict[int, int] = {}
        writer = writer_for(self.task.vehicle, [])

        def plain(value: object) -> Any:
            if not isinstance(value, imc.Message):
                return [writer.to_plain_value(value, f"{self.task.name}: an argument")]
            if id(value) not in places:
                places[id(value)] = len(packets)
                packets.append(imc.encode(value))
            return places[id(value)]

        entries = [(time, key, [plain(value) for value in args]) for time, key, args in self.entries]
        return zlib.compress(msgspec.msgpack.encode(JournalChunk(packets, entries)), 1)


class InputJournals:
    """The journals of all tasks of a vehicle whose classes have async methods, from construction on.

    They slow a run down, so only a run that takes snapshots has them. Raises SnapshotError if vehicles share a kernel.
    """

    def __init__(self, vehicle: Vehicle):
        if vehicle.fleet is not None:
            raise SnapshotError("several vehicles on one kernel cannot be saved")
        self._vehicle = vehicle
        self._kernel = vehicle.kernel
        self._moment, self._early = -1, False
        self._changed: int | None = None
        self._journals = {id(task): InputJournal(task) for task in vehicle.tasks if _has_scripts(type(task))}
        self._handlers: dict[int, tuple[InputJournal, int]] = {}
        vehicle.journals = self
        vehicle.bus.observers.append(self)
        vehicle.kernel.observers.append(self)

    def journal_of(self, task: Task) -> InputJournal:
        """The journal of a task. Raises SnapshotError."""
        self._settle()
        try:
            return self._journals[id(task)]
        except KeyError:
            raise SnapshotError(f"{task.name} runs a script that is not a method of its class") from None

    def resume_journal(self, task: Task, past: JournalStart, handlers: list[Callable[..., object]]) -> None:
        """Continue the journal of a task that has just replayed it."""
        journal = self._journals[id(task)]
        journal.past, journal.entries, journal.values = past, [], _values(task)
        journal.begun, journal.handlers = True, handlers
        for number, handler in enumerate(handlers):
            self._handlers[id(handler)] = journal, number

    def on_subscribe(self, subscription: Subscription) -> None:
        """Number the handlers of each task.

        Those of scripts are local functions, which no name in a file could identify. A replay makes the same
        subscriptions in the same order, so their numbers do.
        """
        task = subscription_task(subscription)
        journal = self._journals.get(id(task))
        if journal is not None:
            self._handlers[id(subscription.handler)] = journal, len(journal.handlers)
            journal.handlers.append(subscription.handler)

    def on_reconfigure(self, owner: object) -> None:
        """Record the parameters that a task uses from now on."""
        journal = self._journals.get(id(owner))
        if journal is not None:
            journal.values = _values(journal.task)
            journal.entries.append((self._kernel.now_ns, CHANGED, (journal.values[0],)))

    def before_call(self, function: Callable[..., object], args: tuple[Any, ...]) -> None:
        """Record a call to a task."""
        now = self._kernel.now_ns
        timer = args[0] if args and isinstance(args[0], Timer) else None
        if self._changed is not None:
            self._settle()
        if now != self._moment:
            is_first, self._moment, self._early = self._moment < 0, now, self._kernel.has_unqueued_timers
            if self._early:
                self._pack_long()
                self._note_in_all(EARLY)
            else:
                if is_first:  # the journal of a restored task may end in an early moment
                    self._note_in_all(QUEUED)
                self._keep_short(now, timer)
        elif self._early and not self._kernel.has_unqueued_timers:
            self._early = False
            self._note_in_all(QUEUED)
        if timer is not None:
            owner = timer.owner
            if timer.function is not None and (journal := self._journals.get(id(owner))) is not None:
                journal.entries.append((now, TIMER, ()))
        elif (known := self._handlers.get(id(function))) is not None:
            known[0].entries.append((now, known[1], args))
            return
        else:
            owner = owner_of(function)
            if (journal := self._journals.get(id(owner))) is not None:
                self._note_call(journal, function, args)
        if owner is self._vehicle.daemon:
            self._changed = now

    def _note_in_all(self, key: str) -> None:
        for journal in self._journals.values():
            journal.entries.append((self._moment, key, ()))

    def _note_call(self, journal: InputJournal, function: Callable[..., object], args: tuple[Any, ...]) -> None:
        if isinstance(function, MethodType):
            journal.entries.append((self._moment, function.__name__, args))
        else:
            journal.invalidate(f"it was called by {function!r}")

    def _settle(self) -> None:
        """Record what the Daemon's last call has set: it changes other tasks directly, without a call by the kernel."""
        time, self._changed = self._changed, None
        if time is None:
            return
        for journal in self._journals.values():
            before, journal.values = journal.values, _values(journal.task)
            values, pushed, active = journal.values
            if (values, pushed) != before[:2]:
                journal.entries.append((time, SET, (values, pushed)))
            if active != before[2]:
                journal.entries.append((time, "activate" if active else "deactivate", ()))

    def _pack_long(self) -> None:
        """Pack long journals in a moment in which none can begin again: its timers are incomplete."""
        for journal in self._journals.values():
            if len(journal.entries) >= MANY:
                journal.pack()

    def _keep_short(self, now: int, popped: Timer | None) -> None:
        """Pack long journals, or begin them again.

        Only at the first call of a moment: nothing but timers is due then, so the state of a task and its timers are
        complete. `popped` is the timer of this call, which the kernel's queue no longer has.
        """
        due: list[Timer] | None = None
        for journal in self._journals.values():
            if journal.begun and len(journal.entries) < MANY:
                continue
            if journal.task.running_scripts:
                journal.pack()
                continue
            if due is None:
                due = [timer for timer in (popped, *self._kernel.timers()) if timer is not None and timer.function]
            for handler in journal.handlers:
                self._handlers.pop(id(handler), None)
            subscriptions = [s for s in self._vehicle.bus.subscriptions if subscription_task(s) is journal.task]
            journal.restart_journal(now, subscriptions, [timer for timer in due if timer.owner is journal.task])
            for number, handler in enumerate(journal.handlers):
                self._handlers[id(handler)] = journal, number


def unpack_chunk(chunk: bytes) -> JournalChunk:
    """The entries of a packed chunk. Raises SnapshotError."""
    try:
        unpacker = zlib.decompressobj()
        data = unpacker.decompress(chunk, LARGEST)
        if not unpacker.eof:
            raise SnapshotError("not a valid snapshot: a journal is cut off")
        check_msgpack_size(data, "a journal")
        return msgspec.msgpack.decode(data, type=JournalChunk)
    except (zlib.error, msgspec.DecodeError):
        raise SnapshotError("not a valid snapshot: a journal is damaged") from None


def _has_scripts(cls: type) -> bool:
    """Whether a class has async methods, which it can run as scripts."""
    return any(inspect.iscoroutinefunction(value) for base in cls.__mro__ for value in vars(base).values())


def _values(task: Task) -> TaskValues:
    """The state that others can set: values of all parameters, those that are pushed, and whether it is active."""
    activation = task.vehicle.activations.get(task.name)
    pushed = [dict(values) for values in task.parameter_set.pushed]
    return dict(task.parameter_set.snapshot()), pushed, activation is not None and activation.active
