"""Brings a task back into the midst of its scripts: it lives once more through what its journal has."""

from collections.abc import Callable
from typing import Any

import imc
from runtime.bus import Subscription
from runtime.kernel import Timer
from runtime.snapshot.checksum import state_checksum
from runtime.snapshot.journal import CHANGED, SET, TIMER, Past, unpacked
from runtime.snapshot.state import (
    connect,
    entities_of,
    nothing,
    reader_for,
    restore_task,
    restore_timer,
    task_of,
)
from runtime.snapshot.values import SnapshotError
from runtime.task import State, Task


def replay_journal(task: Task, past: Past) -> tuple[list[Timer], list[Callable[..., object]]]:
    """Bring a task that hears nothing yet into the state behind its journal; what it publishes is kept by the bus.

    Its timers in their order, and the handlers of its subscriptions in the order of their numbers. The kernel's queue
    is empty before and after. Raises SnapshotError, also where not the same came of it.
    """
    vehicle, kernel = task.vehicle, task.vehicle.kernel
    before, vehicle.bus.witness = vehicle.bus.witness, _Handlers(task)
    handlers = vehicle.bus.witness.handlers
    try:
        kernel.now_ns = past.time
        _begin(task, past)
        for chunk in past.chunks:
            _live(task, chunk, handlers)
        timers = [timer for timer in kernel.timers() if timer.owner is task]
    except Exception as error:
        if isinstance(error, SnapshotError):
            raise
        raise SnapshotError(f"{task.name} cannot be brought back: {type(error).__name__}: {error}") from error
    finally:
        vehicle.bus.witness = before
        kernel.clear()
    if state_checksum(task, timers) != past.likeness:
        raise SnapshotError(
            f"{task.name} cannot be brought back: it is not where it was. Another version wrote the snapshot, or a "
            "script depends on more than what its task hears, its timers and its own state"
        )
    return timers, handlers


class _Handlers:
    """The handlers of a task by the numbers of its subscriptions."""

    def __init__(self, task: Task):
        self.handlers: list[Callable[..., object]] = []
        self._task = task

    def subscribed(self, subscription: Subscription) -> None:
        if task_of(subscription) is self._task:
            self.handlers.append(subscription.handler)

    def reconfigured(self, owner: object) -> None:
        """Part of what it lives through."""


def _begin(task: Task, past: Past) -> None:
    kernel = task.vehicle.kernel
    entities = {entity.label: entity for entity in entities_of(task)}
    for label, state, description, stateful in past.entities:
        entity = entities[label]
        entity.state, entity.description, entity.stateful = State(state), description, stateful
    timers = [kernel.at(state.time, nothing) for state in past.timers]
    reader = reader_for(task.vehicle, timers)
    connect(task, past.state, reader)
    if past.state.tickers:
        queue = kernel.timers()
        task.begin_ticking()
        for timer in kernel.timers():
            if timer not in queue:
                timer.cancel()
    restore_task(task, past.state, reader)
    for timer, state in zip(timers, past.timers, strict=True):
        restore_timer(timer, state, reader)
    task.restored()


def _live(task: Task, data: bytes, handlers: list[Callable[..., object]]) -> None:
    kernel, chunk = task.vehicle.kernel, unpacked(data)
    messages = [imc.decode(packet) for packet in chunk.packets]
    reader = reader_for(task.vehicle, [])
    for time, key, words in chunk.entries:
        if time < kernel.now_ns:
            raise SnapshotError("this is no snapshot: a journal goes back in time")
        kernel.now_ns = time
        args: list[Any] = [messages[word] if isinstance(word, int) else reader.read(word[0]) for word in words]
        if isinstance(key, int):
            handlers[key](*args)
        elif key == TIMER:
            timer = kernel.take(task)
            if timer is None or timer.function is None:
                raise SnapshotError(f"{task.name} cannot be brought back: a timer is missing")
            timer.function(*timer.args)
        elif key == CHANGED:
            task.parameter_set.restore(args[0])
            task.configure()
            task.reconfigured()
        elif key == SET:
            task.parameter_set.restore(args[0])
            task.parameter_set.pushed.clear()
            task.parameter_set.pushed.extend(args[1])
        else:
            reader.read(["method", ["task", task.name], key])(*args)
