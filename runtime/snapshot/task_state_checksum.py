"""A checksum of a task's visible state, which shows whether a replayed journal has led to the saved state."""

import zlib
from collections import deque
from collections.abc import Mapping
from enum import Enum
from types import FunctionType, MethodType
from typing import Any, cast

import msgspec
import numpy as np

import imc
from runtime.kernel import Timer
from runtime.snapshot.serializer import attribute_names
from runtime.snapshot.task_state import BELONGINGS, entities_of, shared_parts, subscription_task
from runtime.task import Entity, Script, Task, Ticker

DEEPEST = 40
LARGEST = 1 << 63


def task_state_checksum(task: Task, timers: list[Timer]) -> int:
    """A checksum of a task: attributes, parameters, ticks, pending calls, subscriptions, entities, waiting scripts.

    A script counts by the line where it waits and its local variables; a value that a snapshot cannot contain, such as
    an iterator, by its type. The order of a set does not count.
    """
    vehicle = task.vehicle
    outline = _Outline({id(part): name for name, part in shared_parts(vehicle)}, timers)
    subscriptions = [s for s in vehicle.bus.subscriptions if subscription_task(s) is task]
    frames = [frame for script in task.running_scripts for frame in script.waiting_frames]
    skipped = BELONGINGS.union(task.transient)
    words = [
        outline.of({name: value for name, value in vars(task).items() if name not in skipped}),
        outline.of(task.parameter_set.snapshot()),
        outline.of([ticker.state() for ticker in task.tickers]),
        [[timer.time, outline.of(timer.function), outline.of(timer.args)] for timer in timers],
        [[s.type.__qualname__, outline.of(s.handler), s.others] for s in subscriptions],
        [[e.label, e.state, e.description.encode(errors="replace"), e.stateful] for e in entities_of(task)],
        [[frame.f_code.co_qualname, frame.f_lineno, outline.of(dict(frame.f_locals))] for frame in frames],
    ]
    return zlib.crc32(msgspec.msgpack.encode(words))


class _Outline:
    """Turns values into lists of numbers and bytes; what belongs to the vehicle counts by its name."""

    def __init__(self, named: Mapping[int, str], timers: list[Timer]):
        self._named = named
        self._timers = {id(timer): number for number, timer in enumerate(timers)}
        self._within: list[int] = []

    def of(self, value: Any) -> Any:
        if value is None or type(value) in (bool, float, bytes):
            return value
        if type(value) is int:
            return value if -LARGEST <= value < LARGEST else str(value)
        if type(value) is str:
            return value.encode(errors="surrogatepass")
        if id(value) in self._named:
            return [self._named[id(value)]]
        if id(value) in self._within or len(self._within) > DEEPEST:
            return ["..."]
        self._within.append(id(value))
        try:
            return self._parts(value)
        finally:
            self._within.pop()

    def _parts(self, value: Any) -> list[Any]:
        kind = cast(type[Any], type(value))
        match value:
            case imc.Message():
                return ["message", _packet(value)]
            case Task() | Ticker():
                return [kind.__name__, repr(value) if isinstance(value, Task) else ""]
            case Entity():
                return ["entity", value.id]
            case Timer():
                return ["timer", self._timers.get(id(value))]
            case Script():
                return ["script", value.done]
            case MethodType():
                return ["method", self.of(value.__self__), value.__name__]
            case FunctionType() | type():
                return ["name", value.__qualname__]
            case Enum():
                return ["enum", kind.__name__, self.of(value.value)]
            case list() | tuple() | deque():
                return [kind.__name__, *map(self.of, cast(list[Any], value))]
            case set() | frozenset():
                return ["set", *sorted(msgspec.msgpack.encode(self.of(item)) for item in cast(set[Any], value))]
            case np.ndarray() | np.generic():
                array = np.asarray(cast(Any, value))
                return ["array", array.dtype.str, zlib.crc32(array.tobytes())]
            case np.random.Generator():
                return ["random", self.of(dict(value.bit_generator.state))]
            case _:
                return self._object(value, kind)

    def _object(self, value: Any, kind: type[Any]) -> list[Any]:
        pairs = value.items() if issubclass(kind, dict) else ()
        names = attribute_names(value)
        found = [[self.of(key), self.of(item)] for key, item in pairs]
        return [kind.__qualname__, found, [[name.encode(), self.of(getattr(value, name))] for name in names]]


def _packet(message: imc.Message) -> bytes:
    try:
        return imc.encode(message)
    except imc.EncodeError:
        return type(message).__name__.encode()
