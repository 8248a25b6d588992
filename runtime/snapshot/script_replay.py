"""Restores a task whose scripts are waiting, by a replay of its journal."""

from collections.abc import Callable
from typing import Any

from runtime.bus import Subscription
from runtime.kernel import Timer
from runtime.snapshot.allowlist import SnapshotError
from runtime.snapshot.input_journal import CHANGED, EARLY, QUEUED, SET, TIMER, JournalStart, unpack_chunk
from runtime.snapshot.task_state import (
    check_parameter_values,
    do_nothing,
    entities_of,
    reader_for,
    restore_pushed_parameters,
    restore_subscriptions,
    restore_task,
    restore_timer,
    subscription_task,
)
from runtime.snapshot.task_state_checksum import task_state_checksum
from runtime.task import State, Task


def replay_journal(task: Task, past: JournalStart) -> tuple[list[Timer], list[Callable[..., object]]]:
    """Replay the journal of a task that has no subscriptions yet; the bus holds back what the task publishes.

    Returns its timers in the order in which they run, and its handlers by number. The kernel's queue is empty before
    and after. Raises SnapshotError, also if the task does not reach the saved state.
    """
    vehicle, kernel = task.vehicle, task.vehicle.kernel
    collector = _Handlers(task)
    before = vehicle.bus.observers
    vehicle.bus.observers = [collector]  # what is replayed must not enter the journal again
    handlers = collector.handlers
    try:
        kernel.set_now(past.time)
        _begin(task, past)
        for chunk in past.chunks:
            _live(task, chunk, handlers)
        timers = [timer for timer in kernel.timers() if timer.owner is task]
    except Exception as error:
        if isinstance(error, SnapshotError):
            raise
        raise SnapshotError(f"{task.name} cannot be restored: its journal does not fit it") from error
    finally:
        vehicle.bus.observers = before
        kernel.clear()
    # A replay repeats the run only if the task depends on nothing but its inputs; otherwise refuse, and do not diverge.
    if task_state_checksum(task, timers) != past.checksum:
        raise SnapshotError(
            f"{task.name} cannot be restored: the replay of its journal ended in another state. Another version wrote "
            "the snapshot, or a script depends on more than the messages, timers and state of its task"
        )
    return timers, handlers


class _Handlers:
    """The handlers of a task, in the order of their subscriptions."""

    def __init__(self, task: Task):
        self.handlers: list[Callable[..., object]] = []
        self._task = task

    def on_subscribe(self, subscription: Subscription) -> None:
        if subscription_task(subscription) is self._task:
            self.handlers.append(subscription.handler)

    def on_reconfigure(self, owner: object) -> None:
        """Skip the change: the journal has it."""


def _begin(task: Task, past: JournalStart) -> None:
    kernel = task.vehicle.kernel
    entities = {entity.label: entity for entity in entities_of(task)}
    for label, state, description, stateful in past.entities:
        entity = entities[label]
        entity.state, entity.description, entity.stateful = State(state), description, stateful
    # Timers first, still empty, because attributes refer to them by index. They are stored in the order in which they
    # run, which decides between timers of the same time.
    timers = [kernel.at(state.time, do_nothing) for state in past.timers]
    reader = reader_for(task.vehicle, timers)
    restore_subscriptions(task, past.state, reader)
    if past.state.tickers:
        queue = kernel.timers()
        task.begin_ticking()
        for timer in kernel.timers():
            if timer not in queue:
                timer.cancel()  # the saved timers include those of the tickers
    restore_task(task, past.state, reader)
    for timer, state in zip(timers, past.timers, strict=True):
        restore_timer(timer, state, reader)
    task.after_restore()


def _live(task: Task, data: bytes, handlers: list[Callable[..., object]]) -> None:
    kernel, chunk = task.vehicle.kernel, unpack_chunk(data)
    messages = [task.vehicle.bus.decode(packet) for packet in chunk.packets]
    reader = reader_for(task.vehicle, [])
    for time, key, words in chunk.entries:
        if time < kernel.now_ns:
            raise SnapshotError("not a valid snapshot: a journal goes back in time")
        if time > kernel.now_ns:
            kernel.set_now(time)
            if key != EARLY:
                kernel.queue_due_timers()
        args: list[Any] = [
            messages[word] if isinstance(word, int) else reader.from_plain_value(word[0]) for word in words
        ]
        if isinstance(key, int):
            handlers[key](*args)
        elif key == TIMER:
            timer = kernel.pop_due(task)
            if timer is None or timer.function is None:
                raise SnapshotError(f"{task.name} cannot be restored: a timer is missing")
            timer.function(*timer.args)
        elif key == EARLY:
            pass
        elif key == QUEUED:
            kernel.queue_due_timers()
        elif key == CHANGED:
            task.parameter_set.restore(check_parameter_values(task, args[0]))
            task.configure()
            task.update_rates()
        elif key == SET:
            task.parameter_set.restore(check_parameter_values(task, args[0]))
            restore_pushed_parameters(task, args[1])
        else:
            reader.from_plain_value(["method", ["task", task.name], key])(*args)
