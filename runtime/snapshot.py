"""Saves a virtual run between two moments, and goes on from there."""

from collections.abc import Iterator
from typing import Any, cast

import msgspec

from runtime.bus import Bus
from runtime.entities import Entity
from runtime.handlers import Ticker
from runtime.kernel import Timer
from runtime.logbook import Logbook
from runtime.script import Script
from runtime.snapshot_values import Reader, SnapshotError, Writer
from runtime.task import Task
from runtime.vehicle import Vehicle

FORMAT = "shoal snapshot 1"
BELONGINGS = frozenset(
    {
        "vehicle",
        "name",
        "entity",
        "system",
        "system_name",
        "log",
        "parameter_set",
        "_kernel",
        "_bus",
        "_tickers",
        "_scripts",
    }
)
"""What the vehicle gives a task: no state of its own."""


class TimerState(msgspec.Struct, array_like=True):
    """A call that is due: time (ns), and the plain forms of owner, function and arguments."""

    time: int
    owner: Any
    function: Any
    args: list[Any]


class TaskState(msgspec.Struct, array_like=True):
    """A task: its section and class, its attributes, its ticks, and remembered parameters."""

    section: str
    kind: str
    attributes: list[tuple[str, Any]]
    tickers: list[Any]
    pushed: Any


class Snapshot(msgspec.Struct):
    """A vehicle at a time (ns), between what was due before it and what is due at it."""

    format: str
    vehicle: str
    time: int
    start_time: float
    seed: int
    configuration: bytes
    tasks: list[TaskState]
    timers: list[TimerState]
    subscribed: list[str]
    running: list[str]
    entities: list[tuple[str, int, Any, str, bool]]
    heard: list[tuple[int, int, str]]
    activations: list[tuple[str, Any, str]]


def save(vehicle: Vehicle) -> bytes:
    """The state of a vehicle on a virtual clock, between two runs of its kernel.

    Raises SnapshotError for what cannot be saved: it names the task and the attribute.
    """
    if not vehicle.virtual or not vehicle.kernel.idle:
        raise SnapshotError("only a virtual run can be saved, and only between two moments")
    if vehicle.failures:
        raise SnapshotError(f"{', '.join(vehicle.failures)}: a task that failed cannot be saved")
    timers = [timer for timer in vehicle.kernel.timers() if _is_ours(timer)]
    places = {id(timer): index for index, timer in enumerate(timers)}
    writer = Writer(lambda value: _name(value, vehicle, places))
    return msgspec.msgpack.encode(
        Snapshot(
            FORMAT,
            vehicle.name,
            vehicle.kernel.now_ns,
            vehicle.start_time,
            vehicle.seed,
            vehicle.profile.dump().encode(errors="surrogateescape"),
            [_task_state(task, writer) for task in vehicle.tasks],
            [_timer_state(timer, writer) for timer in timers],
            [owner.name for owner in vehicle.bus.owners if isinstance(owner, Task)],
            sorted(vehicle.running),
            [(e.label, e.id, writer.write(e.state, e.label), e.description, e.stateful) for e in vehicle.entities],
            [(system, entity, label) for (system, entity), label in vehicle.entities.heard.items()],
            [(name, writer.write(a.phase, name), a.error) for name, a in vehicle.activations.items()],
        )
    )


def load(data: bytes) -> Snapshot:
    """What a snapshot says. Raises SnapshotError for what is none."""
    try:
        found = msgspec.msgpack.decode(data, type=Snapshot)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise SnapshotError(f"this is no snapshot: {error}") from None
    if found.format != FORMAT:
        raise SnapshotError(f"this is a {found.format!r}, not a {FORMAT!r}")
    return found


def restore(vehicle: Vehicle, snapshot: Snapshot) -> None:
    """Bring a vehicle that is built and not started into the state of a snapshot; then it runs on.

    Its clock is virtual and begins at the snapshot's time. Raises SnapshotError.
    """
    tasks = {task.name: task for task in vehicle.tasks}
    if [state.section for state in snapshot.tasks] != list(tasks):
        raise SnapshotError(f"the vehicle has other tasks than the snapshot: {', '.join(tasks)}")
    for name in snapshot.subscribed:
        tasks[name].connect()
    for task in vehicle.tasks:
        task.begin_ticking()
    vehicle.kernel.clear()
    vehicle.bus.resume()
    timers = [vehicle.kernel.at(state.time, _nothing) for state in snapshot.timers]
    trusted = {type(task).__module__.partition(".")[0] for task in vehicle.tasks}
    reader = Reader(lambda words: _find(words, vehicle, timers), trusted, (Task, Ticker, Bus))
    try:
        for state in snapshot.tasks:
            _restore_task(tasks[state.section], state, reader)
        for timer, state in zip(timers, snapshot.timers, strict=True):
            timer.owner = reader.read(state.owner)
            timer.function = reader.read(state.function)
            timer.args = tuple(reader.read(word) for word in state.args)
        for label, number, phase, description, stateful in snapshot.entities:
            entity = vehicle.entities.find(label)
            if entity is None or entity.id != number:
                raise SnapshotError(f"the vehicle has no entity {label!r} of id {number}")
            entity.state, entity.description, entity.stateful = reader.read(phase), description, stateful
        for name, phase, error in snapshot.activations:
            vehicle.activations[name].phase, vehicle.activations[name].error = reader.read(phase), error
    except (KeyError, IndexError, TypeError, ValueError, AttributeError) as error:
        raise error if isinstance(error, SnapshotError) else SnapshotError(f"this is no snapshot: {error!r}") from error
    for system, entity, label in snapshot.heard:
        vehicle.entities.hear(system, entity, label)
    vehicle.start_time = snapshot.start_time
    vehicle.running.update(snapshot.running)
    for task in vehicle.tasks:
        task.restored()


def _nothing() -> None:
    """Stands in a timer until it has its function."""


def _is_ours(timer: Timer) -> bool:
    """Whether a call is the vehicle's; others are those of who looks on."""
    module = type(timer.owner).__module__
    return not module.startswith("runtime.cli")


def _task_state(task: Task, writer: Writer) -> TaskState:
    if task.running_scripts:
        raise SnapshotError(f"{task.name} runs a script, which no snapshot takes")
    skipped = BELONGINGS.union(task.transient)
    state = {name: value for name, value in vars(task).items() if name not in skipped}
    plain = [(name, writer.write(value, f"{task.name}: {name}")) for name, value in state.items()]
    tickers = [writer.write(ticker.state(), task.name) for ticker in task.tickers]
    kind = f"{type(task).__module__}:{type(task).__qualname__}"
    return TaskState(task.name, kind, plain, tickers, writer.write(list(task.parameter_set.pushed), task.name))


def _timer_state(timer: Timer, writer: Writer) -> TimerState:
    where = f"{timer.owner!r}: a call that is due"
    owner, function = writer.write(timer.owner, where), writer.write(timer.function, where)
    return TimerState(timer.time, owner, function, [writer.write(part, where) for part in timer.args])


def _restore_task(task: Task, state: TaskState, reader: Reader) -> None:
    kind = f"{type(task).__module__}:{type(task).__qualname__}"
    if kind != state.kind:
        raise SnapshotError(f"{task.name} is a {kind} here, and a {state.kind} in the snapshot")
    for name, value in state.attributes:
        if name not in BELONGINGS:
            setattr(task, name, reader.read(value))
    for ticker, plain in zip(task.tickers, state.tickers, strict=True):
        ticker.restore(*reader.read(plain))
    task.parameter_set.pushed.extend(reader.read(state.pushed))


def _name(value: object, vehicle: Vehicle, timers: dict[int, int]) -> list[Any] | None:
    """What a value is called that belongs to the vehicle; None for a value of its own."""
    if isinstance(value, Task):
        return ["task", value.name]
    if isinstance(value, Entity):
        return ["entity", value.label]
    if isinstance(value, Logbook):
        return ["log", next(task.name for task in vehicle.tasks if task.log is value)]
    if isinstance(value, Timer):
        return ["timer", timers[id(value)]] if id(value) in timers else ["over"]
    if isinstance(value, Ticker):
        return next(["ticker", t.name, t.tickers.index(value)] for t in vehicle.tasks if value in t.tickers)
    if isinstance(value, Script):
        raise SnapshotError(f"{value.task.name} runs a script, which no snapshot takes")
    return next(([name] for name, part in _parts(vehicle) if part is value), None)


def _parts(vehicle: Vehicle) -> Iterator[tuple[str, object]]:
    yield from (("vehicle", vehicle), ("kernel", vehicle.kernel), ("bus", vehicle.bus), ("entities", vehicle.entities))
    yield from (("systems", vehicle.systems), ("profile", vehicle.profile))


def _find(words: list[Any], vehicle: Vehicle, timers: list[Timer]) -> object:
    match words:
        case ["task", str(name)]:
            return vehicle.task(name)
        case ["entity", str(label)]:
            return vehicle.entities.find(label)
        case ["log", str(name)]:
            return vehicle.task(name).log
        case ["timer", int(index)]:
            return timers[index]
        case ["over"]:
            over = Timer(0, _nothing, ())
            over.cancel()
            return over
        case ["ticker", str(name), int(index)]:
            return vehicle.task(name).tickers[index]
        case [str(name)] if (part := dict(_parts(vehicle)).get(name)) is not None:
            return part
        case _:
            raise SnapshotError(f"this is no snapshot: {cast(object, words[0])!r} is unknown")
