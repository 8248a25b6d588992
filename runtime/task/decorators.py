"""The decorators of methods: `@consume` for messages, `@periodic` for a rate, `@expect` for data that have to come."""

import functools
import inspect
from collections.abc import Callable, Mapping
from types import FunctionType, UnionType
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar, Union, cast, get_args, get_origin, get_type_hints, overload

from runtime.kernel import SECOND, Timer
from runtime.task.parameters import ParameterError

if TYPE_CHECKING:
    from runtime.task.task import Task

HIGHEST_RATE = 1e6  # Hz
JUDGING_RATE = 4.0  # Hz; how often data that are expected are looked for

F = TypeVar("F", bound=Callable[..., object])


class ConsumerMethod(NamedTuple):
    """A method that is subscribed to one type."""

    method: str
    type: type
    others: bool
    packets: bool


class PeriodicMethod(NamedTuple):
    """A method that runs at a rate: hertz, or the attribute of a parameter in hertz."""

    method: str
    rate: float | str
    counts: bool


@overload
def consume(method: F) -> F: ...
@overload
def consume(*, others: bool = False, packets: bool = False) -> Callable[[F], F]: ...
def consume(method: F | None = None, *, others: bool = False, packets: bool = False) -> F | Callable[[F], F]:
    """Subscribes a method to messages of the own system; the annotation of its argument is the type.

    The annotation is a message class, a union of several, `imc.Message` for all, or a class such as Frame that tasks
    share. With `others` it receives from every system, with `packets` it gets the encoded packet as a second argument.
    """

    def mark(function: F) -> F:
        function.__dict__["_shoal_consume"] = (others, packets)
        return function

    return mark if method is None else mark(method)


def periodic(rate: float | str) -> Callable[[F], F]:
    """Makes a method run at `rate`: hertz, or the attribute of a parameter in hertz (0 pauses it).

    A method with an argument gets the number of periods since its last call: 1, or more if late ticks became one.
    """

    def mark(function: F) -> F:
        function.__dict__["_shoal_periodic"] = rate
        return function

    return mark


def expect(every: float | str) -> Callable[[F], F]:
    """Expects a method to be called, and to return, every so many seconds (0 is never), else the entity is in ERROR.

    `every` may be the attribute of a parameter in seconds. With the next data the entity is in NORMAL again. The method
    takes lines or frames of a device, or it is one with `@consume`.
    """

    def mark(function: F) -> F:
        @functools.wraps(function)
        def expected(task: Any, *args: Any, **more: Any) -> object:
            result = function(task, *args, **more)
            task.note_data(function.__name__)
            return result

        expected.__dict__["_shoal_expect"] = every
        return cast(F, expected)

    return mark


@functools.cache
def expected_methods(cls: type) -> Mapping[str, float | str]:
    """The methods of a class that expect data: seconds, or the attribute of a parameter in seconds.

    Raises TypeError for an unknown parameter.
    """
    found: dict[str, float | str] = {}
    for name, method in _methods(cls):
        every = getattr(method, "_shoal_expect", None)
        if isinstance(every, str) and not hasattr(cls, every):
            raise TypeError(f"{cls.__name__}.{name}: there is no parameter {every!r}")
        if every is not None:
            _refuse_coroutines(cls, name, method)
            found[name] = every
    return found


@functools.cache
def consumer_methods(cls: type) -> tuple[ConsumerMethod, ...]:
    """The subscriptions of a class, in the order of definition. Raises TypeError for a bad annotation."""
    found: list[ConsumerMethod] = []
    for name, method in _methods(cls):
        wish = getattr(method, "_shoal_consume", None)
        if wish is None:
            continue
        _refuse_coroutines(cls, name, method)
        others, packets = wish
        arguments = list(inspect.signature(method).parameters)[1:]
        hint = get_type_hints(method).get(arguments[0]) if arguments else None
        for kind in get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,):
            if not isinstance(kind, type) or kind.__module__ == "builtins":
                raise TypeError(f"{cls.__name__}.{name}: annotate the argument with the message that it consumes")
            found.append(ConsumerMethod(name, kind, others, packets))
    return tuple(found)


@functools.cache
def periodic_methods(cls: type) -> tuple[PeriodicMethod, ...]:
    """The periodic methods of a class, in the order of definition. Raises TypeError for an unknown parameter."""
    found: list[PeriodicMethod] = []
    for name, method in _methods(cls):
        rate = getattr(method, "_shoal_periodic", None)
        if isinstance(rate, str) and not hasattr(cls, rate):
            raise TypeError(f"{cls.__name__}.{name}: there is no parameter {rate!r}")
        if rate is not None:
            _refuse_coroutines(cls, name, method)
            found.append(PeriodicMethod(name, rate, len(inspect.signature(method).parameters) > 1))
    if expected_methods(cls):
        found.append(PeriodicMethod("check_data", JUDGING_RATE, False))
    return tuple(found)


def number_or_parameter(task: object, number: float | str) -> float:
    """A number, or the value of the parameter with this attribute."""
    return float(getattr(task, number)) if isinstance(number, str) else number


def rate_of(task: "Task", rate: float | str) -> float:
    """The rate of a periodic method in hertz. Raises ParameterError if it is above `HIGHEST_RATE` or not a number."""
    hertz = number_or_parameter(task, rate)
    if not hertz <= HIGHEST_RATE:
        name = next((p.name for p in task.parameters().values() if p.attribute == rate), str(rate))
        raise ParameterError(name, f"cannot run at {hertz:g} Hz (expects at most {HIGHEST_RATE:g} Hz)")
    return hertz


class Ticker:
    """Calls a periodic method of a task, at multiples of its period since the start, so it does not drift.

    On a wall clock late ticks become one, and `missed` counts the others of all that were `due`; on a virtual clock
    none is late.
    """

    def __init__(self, task: "Task", ticking: PeriodicMethod):
        self.missed: int = 0
        self._due_before: int = 0
        self._count: int = 0
        self._task = task
        self._kernel = task.vehicle.kernel
        self.handler: Callable[..., object] = getattr(task, ticking.method)
        self._counts = ticking.counts
        self._rate = ticking.rate
        self._hertz: float = -1.0
        self._timer: Timer | None = None
        self.update_rate()

    def update_rate(self) -> None:
        """Start again if the rate has changed. Raises ParameterError if it is too high."""
        hertz = rate_of(self._task, self._rate)
        if hertz == self._hertz:
            return
        self.stop()
        self._due_before = self.due
        self._hertz, self._count, self._start = hertz, 0, self._kernel.now_ns
        if hertz > 0.0:
            self._timer = self._kernel.at(self._start, self._tick)
            self._timer.owner = self._task

    @property
    def due(self) -> int:
        """The number of ticks so far, also at former rates, the next one included."""
        return self._due_before + self._count

    def state(self) -> tuple[float, int, int, int, Timer | None]:
        """The mutable state: rate (Hz), number of the next tick, start (ns), missed ticks, timer of the next tick."""
        return self._hertz, self._count, self._start, self.missed, self._timer

    def restore(self, hertz: float, count: int, start: int, missed: int, timer: Timer | None) -> None:
        """Continue from a `state` whose timer is already in the kernel."""
        self._hertz, self._count, self._start, self.missed, self._timer = hertz, count, start, missed, timer
        if timer is not None:
            timer.function = self._tick

    def stop(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _tick(self) -> None:
        kernel, missed = self._kernel, 0
        count = self._count + 1
        if not kernel.virtual:
            latest = int((kernel.now_ns - self._start) * self._hertz / SECOND)
            missed = max(0, latest - count)
            count += missed
            self.missed += missed
        self._count = count
        assert self._timer is not None
        # First, since the method may change the rate or stop the task.
        kernel.schedule_timer(self._timer, self._start + round(count * SECOND / self._hertz))
        if self._counts:
            self.handler(missed + 1)
        else:
            self.handler()


def _refuse_coroutines(cls: type, name: str, method: Callable[..., object]) -> None:
    if inspect.iscoroutinefunction(method):
        raise TypeError(f"{cls.__name__}.{name}: handlers are not async; self.start_script(...) starts a script")


@functools.cache
def _methods(cls: type) -> tuple[tuple[str, Any], ...]:
    """The methods of a class that may have marks, which are attributes, in the order of definition."""
    names = dict.fromkeys(name for base in reversed(cls.__mro__) for name in vars(base))
    found = ((name, getattr(cls, name, None)) for name in names)
    return tuple((name, method) for name, method in found if isinstance(method, FunctionType) and vars(method))
