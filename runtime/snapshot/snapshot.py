"""Saves a virtual run between two moments, and continues it from there."""

import errno
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec

from runtime.kernel import SECOND, Timer, nanoseconds, owner_of, owner_title
from runtime.snapshot.allowlist import LARGEST, SnapshotError, check_msgpack_size, short_repr
from runtime.snapshot.input_journal import JournalStart
from runtime.snapshot.script_replay import replay_journal
from runtime.snapshot.serializer import StateWriter
from runtime.snapshot.task_state import (
    TaskState,
    TimerState,
    do_nothing,
    reader_for,
    restore_subscriptions,
    restore_task,
    restore_timer,
    subscription_task,
    task_state,
    timer_state,
    writer_for,
)
from runtime.snapshot.task_state_checksum import task_state_checksum
from runtime.task import State, Task, with_location
from runtime.vehicle import Vehicle
from support.atomic_files import replace_file
from support.text_length import list_first

FORMAT = "shoal snapshot 6"
STATE, SUFFIX = "State-", ".msgpack"
MOST_NAMED = 5  # tasks in one error
LATEST = 1 << 62  # ns since 1970: the year 2116


class Snapshot(msgspec.Struct):
    """A vehicle at a time (ns): all calls before this time are done, none at this time.

    A task is in `tasks`, or in `journals` if it runs a script. timers: in the order in which they run, which decides
    between timers of the same time. subscriptions: the task of each, in the order in which they are served.
    profile: what the profile has for parameters that have been changed since, by task and ini name.
    """

    vehicle: str
    time: int
    start_time: float
    seed: int
    configuration: bytes
    profile: dict[str, dict[str, bytes]]
    sections: list[str]
    tasks: dict[str, TaskState]
    journals: dict[str, JournalStart]
    timers: list[TimerState]
    subscriptions: list[str]
    running: list[str]
    entities: list[tuple[str, int, Any, str, bool]]
    remote_labels: list[tuple[int, int, str]]
    activations: list[tuple[str, Any, str]]


class SnapshotFile(msgspec.Struct, array_like=True):
    """The content of a file: its format, and a snapshot in msgpack with its checksum."""

    format: str
    checksum: int
    snapshot: bytes


def take_snapshot(vehicle: Vehicle) -> bytes:
    """The state of a vehicle on a virtual clock, between two runs of its kernel.

    While scripts run it needs InputJournals, kept since before they began. Raises SnapshotError naming the task and the
    attribute, or the observer, that cannot be saved.
    """
    if not vehicle.has_virtual_time or not vehicle.kernel.is_idle:
        raise SnapshotError("only a virtual run can be saved, and only between two moments")
    if vehicle.failures:
        raise SnapshotError(f"{', '.join(vehicle.failures)}: a task that failed cannot be saved")
    _refuse_strangers(vehicle)
    timers = [timer for timer in vehicle.kernel.timers() if not vehicle.has_observer(timer.owner)]
    if any(isinstance(timer.owner, Task) and timer.owner.vehicle is not vehicle for timer in timers):
        raise SnapshotError("several vehicles on one kernel cannot be saved")
    writer = writer_for(vehicle, timers)
    subscriptions = [(task, s) for s in vehicle.bus.subscriptions if (task := subscription_task(s)) is not None]
    plain = [task for task in vehicle.tasks if not task.running_scripts]
    scripted = [task for task in vehicle.tasks if task.running_scripts]
    snapshot = Snapshot(
        vehicle.name,
        vehicle.kernel.now_ns,
        vehicle.start_time,
        vehicle.seed,
        _bytes(vehicle.profile.dump()),
        {
            name: {option: _bytes(text) for option, text in t.items()}
            for name, t in vehicle.effective_config.original_values().items()
        },
        [task.name for task in vehicle.tasks],
        {task.name: task_state(task, [s for owner, s in subscriptions if owner is task], writer) for task in plain},
        {task.name: _past(task, timers) for task in scripted},
        [_timer_state(timer, scripted, writer) for timer in timers],
        [task.name for task, _ in subscriptions],
        sorted(vehicle.running),
        [(e.label, e.id, writer.to_plain_value(e.state, e.label), e.description, e.stateful) for e in vehicle.entities],
        [(system, entity, label) for (system, entity), label in vehicle.entities.remote_labels.items()],
        [(name, writer.to_plain_value(a.phase, name), a.error) for name, a in vehicle.activations.items()],
    )
    data = msgspec.msgpack.encode(snapshot)
    check_msgpack_size(data, f"the state of {vehicle.name}")
    return msgspec.msgpack.encode(SnapshotFile(FORMAT, zlib.crc32(data), data))


def load_file(path: Path) -> Snapshot:
    """Read a snapshot from a file. Raises OSError, and SnapshotError if it is not one, or is damaged."""
    if not path.is_file():
        raise SnapshotError("not a file")
    with path.open("rb") as file:
        return load(file.read(LARGEST + 1))


def load(data: bytes) -> Snapshot:
    """Decode a snapshot. Raises SnapshotError if the data is not one, or is damaged."""
    if len(data) > LARGEST:
        raise SnapshotError(f"not a valid snapshot: it has more than {LARGEST >> 20} MiB")
    try:
        found = msgspec.msgpack.decode(data, type=SnapshotFile)
        if found.format != FORMAT:
            raise SnapshotError(f"this is a {short_repr(found.format)}, not a {FORMAT!r}")
        if zlib.crc32(found.snapshot) != found.checksum:
            raise SnapshotError("this snapshot is damaged")
        check_msgpack_size(found.snapshot)
        snapshot = msgspec.msgpack.decode(found.snapshot, type=Snapshot)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        raise SnapshotError("not a valid snapshot: this is another kind of file, or damaged") from None
    earliest = [past.time for past in snapshot.journals.values()]
    latest = [timer.time for timer in snapshot.timers]
    if not 0 <= min([*earliest, snapshot.time]) <= snapshot.time <= max([*latest, snapshot.time]) < LATEST:
        raise SnapshotError("not a valid snapshot: it has an impossible time")
    if min(latest, default=snapshot.time) < snapshot.time or not 0.0 <= snapshot.start_time <= snapshot.time / SECOND:
        raise SnapshotError("not a valid snapshot: its times do not fit each other")
    return snapshot


def restore(vehicle: Vehicle, snapshot: Snapshot) -> None:
    """Bring a vehicle that is built but not started into the state of a snapshot, ready to run.

    Its clock has to be virtual and begin at the snapshot's time. Raises SnapshotError. An exception of a task in the
    run is a SnapshotError, too, since a state that no vehicle ever had can make any task fail.
    """
    tasks = {task.name: task for task in vehicle.tasks}
    if snapshot.sections != list(tasks):
        differ = sorted(tasks.keys() ^ set(snapshot.sections)) or list(tasks)
        listed = list_first([*map(short_repr, differ)], MOST_NAMED)
        raise SnapshotError(f"the vehicle has other tasks than the snapshot: {listed}")
    if sorted([*snapshot.tasks, *snapshot.journals]) != sorted(tasks) or not tasks.keys() >= set(snapshot.running):
        raise SnapshotError("not a valid snapshot: it has not exactly one state of each task")
    vehicle.attribute_error = _blame
    try:
        _restore(vehicle, snapshot)
    except SnapshotError:
        raise
    except Exception as error:
        raise SnapshotError("not a valid snapshot: it does not fit the vehicle") from error


def _blame(owner: object, error: Exception) -> Exception:
    if isinstance(error, SnapshotError):
        return error
    blamed = SnapshotError(f"{owner_title(owner)} failed with the state of the snapshot: {with_location(error)}")
    blamed.__cause__ = error
    return blamed


def run_with_snapshots(
    vehicle: Vehicle, seconds: float | None, every: float, keep: Callable[[bytes], object]
) -> list[OSError]:
    """Run a vehicle, and pass its state to `keep` every `every` seconds of its time. Raises SnapshotError.

    A disk that rejects a snapshot does not end the run; returns the errors of all that are missing.
    """
    missing: list[OSError] = []
    begin = vehicle.kernel.now_ns
    end = None if seconds is None else begin + round(seconds * SECOND)
    count = 1
    while True:
        pause = begin + round(count * every * SECOND)
        if end is not None and pause >= end:
            vehicle.kernel.run(until=end)
            return missing
        vehicle.kernel.run(until=pause)
        if vehicle.kernel.now_ns < pause or not vehicle.kernel.is_idle:
            return missing
        try:
            keep(take_snapshot(vehicle))
        except OSError as error:
            missing.append(error)
        count += 1


def save_beside_log(vehicle: Vehicle, state: bytes) -> None:
    """Write a snapshot beside the log: State-<seconds of the run>.msgpack. Raises SnapshotError, OSError."""
    folder = vehicle.log_folder
    if folder is None and vehicle.keeps_log:
        raise FileNotFoundError(errno.ENOENT, "there is no log folder to keep it in")
    if folder is None:
        raise SnapshotError("snapshots are kept beside the log, and no task writes one")
    seconds = (vehicle.kernel.now_ns - nanoseconds(vehicle.start_time)) / SECOND
    name = f"{STATE}{seconds:.9f}".rstrip("0").rstrip(".")
    with replace_file(folder / f"{name}{SUFFIX}") as file:
        file.write(state)


def _restore(vehicle: Vehicle, snapshot: Snapshot) -> None:
    kernel = vehicle.kernel
    kernel.clear()
    vehicle.start_time = snapshot.start_time
    changed = {name: {o: _text(t) for o, t in texts.items()} for name, texts in snapshot.profile.items()}
    try:
        vehicle.effective_config.set_original_values(changed)
    except KeyError as error:
        unknown = short_repr(str(error.args[0]))
        raise SnapshotError(f"not a valid snapshot: the vehicle has no parameter {unknown}") from None
    for system, entity, label in snapshot.remote_labels:
        vehicle.entities.learn_label(system, entity, label)
    # Scripts first: their replay makes the timers and subscriptions that are put in order below.
    scripted = _replay(vehicle, snapshot.journals)
    kernel.set_now(snapshot.time)
    timers = [_timer(state, scripted) for state in snapshot.timers]
    if any(scripted.values()):
        raise SnapshotError("not a valid snapshot: a timer is missing")
    reader = reader_for(vehicle, timers)
    for section, state in snapshot.tasks.items():
        try:
            restore_subscriptions(vehicle.task(section), state, reader)
            if state.tickers:
                vehicle.task(section).begin_ticking()
            restore_task(vehicle.task(section), state, reader)
        except SnapshotError:
            raise
        except Exception as error:
            raise SnapshotError(f"not a valid snapshot: its state of {section} does not fit this task") from error
    for timer, state in zip(timers, snapshot.timers, strict=True):
        if state.function is not None:
            restore_timer(timer, state, reader)
    kernel.replace_timers(timers)
    _arrange(vehicle, snapshot.subscriptions)
    for label, number, phase, description, stateful in snapshot.entities:
        entity = vehicle.entities.find(label)
        if entity is None or entity.id != number:
            raise SnapshotError(f"the vehicle has no entity {short_repr(label)} of id {number}")
        entity.state, entity.description, entity.stateful = State(reader.from_plain_value(phase)), description, stateful
    for name, phase, error in snapshot.activations:
        activation = vehicle.activations[name]
        activation.phase, activation.error = type(activation.phase)(reader.from_plain_value(phase)), error
    for section in snapshot.tasks:
        vehicle.task(section).after_restore()
    vehicle.bus.discard_backlog()
    vehicle.running.update(snapshot.running)


def _refuse_strangers(vehicle: Vehicle) -> None:
    """Raise SnapshotError for who is no task but takes part in the run, which a restored run would lack silently."""
    for subscription in vehicle.bus.subscriptions:
        owner = owner_of(subscription.handler)
        if subscription_task(subscription) is None and not vehicle.has_observer(owner):
            raise SnapshotError(
                f"{owner_title(owner)} receives {subscription.type.__name__} and is no task, so it cannot be restored: "
                "make it a task, or use Vehicle.observe if it only watches"
            )
    for timer in vehicle.kernel.timers():
        if vehicle.has_observer(timer.owner) and not getattr(timer.owner, "transient", False):
            raise SnapshotError(
                f"the observer {owner_title(timer.owner)} has a pending call, so it cannot be restored: make it a "
                "task, or set its attribute transient = True if the run does not need it"
            )


def _bytes(text: str) -> bytes:
    return text.encode(errors="surrogateescape")


def _text(data: bytes) -> str:
    return data.decode(errors="surrogateescape")


def _replay(vehicle: Vehicle, pasts: dict[str, JournalStart]) -> dict[str, list[Timer]]:
    """Restore the tasks that run scripts; returns their timers."""
    timers = dict[str, list[Timer]]()
    for section, past in pasts.items():
        task = vehicle.task(section)
        timers[section], handlers = replay_journal(task, past)
        if vehicle.journals is not None:
            vehicle.journals.resume_journal(task, past, handlers)
    return timers


def _past(task: Task, timers: list[Timer]) -> JournalStart:
    journals = task.vehicle.journals
    if journals is None:
        raise SnapshotError(f"{task.name} runs a script, and no journals are kept")
    return journals.journal_of(task).snapshot(
        task_state_checksum(task, [timer for timer in timers if timer.owner is task])
    )


def _timer_state(timer: Timer, scripted: list[Task], writer: StateWriter) -> TimerState:
    """A timer; without a function if its task gets it back by the replay of a journal."""
    if isinstance(timer.owner, Task) and timer.owner in scripted:
        return TimerState(timer.time, timer.owner.name, None, [])
    return timer_state(timer, writer)


def _timer(state: TimerState, scripted: dict[str, list[Timer]]) -> Timer:
    if state.function is not None:
        return Timer(state.time, do_nothing, ())
    timer = scripted[state.owner].pop(0)
    if timer.time != state.time:
        raise SnapshotError(f"not a valid snapshot: {state.owner} has no timer at this time")
    return timer


def _arrange(vehicle: Vehicle, turns: list[str]) -> None:
    """Serve the subscriptions of all tasks in the saved order, after those of observers."""
    others = [s for s in vehicle.bus.subscriptions if subscription_task(s) is None]
    own = {task.name: [s for s in vehicle.bus.subscriptions if subscription_task(s) is task] for task in vehicle.tasks}
    arranged = [own[name].pop(0) for name in turns]
    if any(own.values()):
        raise SnapshotError("not a valid snapshot: a subscription is missing")
    vehicle.bus.set_subscriptions([*others, *arranged])
