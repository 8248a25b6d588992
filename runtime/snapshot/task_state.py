"""The state of one task as plain values: attributes, ticks, timers and subscriptions."""

from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from types import MethodType
from typing import Any, cast

import msgspec

from runtime.bus import Bus, Subscription
from runtime.kernel import SECOND, Timer, owner_title
from runtime.snapshot.allowlist import ClassAllowlist, SnapshotError, check_attribute, short_repr
from runtime.snapshot.serializer import StateReader, StateWriter
from runtime.task import HIGHEST_RATE, Entity, Logbook, Parameter, Script, Task, Ticker
from runtime.vehicle import Vehicle

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
        "_devices",
        "_tickers",
        "_scripts",
    }
)
"""Attributes that the vehicle gives a task; they are not part of its state."""
OF_VEHICLE = frozenset({"_start"})
"""Methods of a vehicle that a timer may call."""


class TimerState(msgspec.Struct, array_like=True):
    """A pending call: time (ns), and the plain forms of owner, function and arguments."""

    time: int
    owner: Any
    function: Any
    args: list[Any]


class SubscriptionState(msgspec.Struct, array_like=True):
    """A subscription of a task: the plain form of the type, the name of its method, and its flags."""

    type: Any
    method: str
    others: bool
    packets: bool


class TaskState(msgspec.Struct, array_like=True):
    """A task: its section and class, attributes, ticks, pushed parameters, and subscriptions."""

    section: str
    kind: str
    attributes: list[tuple[str, Any]]
    tickers: list[Any]
    pushed: Any
    subscriptions: list[SubscriptionState]


def subscription_task(subscription: Subscription) -> Task | None:
    """The task of a subscription; None for other subscribers."""
    owner = subscription.owner
    owner = owner.task if isinstance(owner, Script) else owner
    return owner if isinstance(owner, Task) else None


def entities_of(task: Task) -> list[Entity]:
    """The entities of a task."""
    return [entity for entity in task.vehicle.entities if entity.component == task.name]


def task_state(task: Task, subscriptions: Iterable[Subscription], writer: StateWriter) -> TaskState:
    """The state of a task that runs no script, with its subscriptions. Raises SnapshotError."""
    task.before_snapshot()
    skipped = BELONGINGS.union(task.transient)
    state = {name: value for name, value in vars(task).items() if name not in skipped}
    for name in state:
        try:
            check_attribute(type(task), name)
        except SnapshotError as error:
            raise SnapshotError(f"{task.name}: {error}") from None
    try:
        plain = [(name, writer.to_plain_value(value, f"{task.name}: {name}")) for name, value in state.items()]
    except RecursionError:
        raise SnapshotError(f"the state of {task.name} is nested too deep") from None
    return TaskState(
        task.name,
        _kind(task),
        plain,
        [writer.to_plain_value(ticker.state(), task.name) for ticker in task.tickers],
        writer.to_plain_value(list(task.parameter_set.pushed), task.name),
        [_subscription_state(task, subscription, writer) for subscription in subscriptions],
    )


def timer_state(timer: Timer, writer: StateWriter) -> TimerState:
    """Raises SnapshotError, also for a timer of a stranger, which no vehicle could have again."""
    if not isinstance(timer.owner, (Task, Vehicle, Bus)):
        raise SnapshotError(
            f"{owner_title(timer.owner)} has a pending call and is no task, so it cannot be restored: make it a task"
        )
    where = f"{owner_title(timer.owner)}: a pending call"
    owner, function = writer.to_plain_value(timer.owner, where), writer.to_plain_value(timer.function, where)
    return TimerState(timer.time, owner, function, [writer.to_plain_value(part, where) for part in timer.args])


def restore_subscriptions(task: Task, state: TaskState, reader: StateReader) -> None:
    """Subscribe a task to its messages again."""
    for subscribed in state.subscriptions:
        handler = reader.from_plain_value(["method", ["task", task.name], subscribed.method])
        task.vehicle.bus.subscribe(
            Subscription(reader.from_plain_value(subscribed.type), handler, task, subscribed.others, subscribed.packets)
        )


def restore_task(task: Task, state: TaskState, reader: StateReader) -> None:
    """Restore attributes, ticks and parameters; the timers exist already. Raises SnapshotError."""
    if _kind(task) != state.kind:
        raise SnapshotError(f"{task.name} is a {_kind(task)} here, but a {state.kind} in the snapshot")
    declared = {parameter.attribute: parameter for parameter in task.parameter_set.declarations.values()}
    refused = BELONGINGS.union(task.transient)
    for name, plain in state.attributes:
        value = reader.from_plain_value(plain)
        if name in refused:
            raise SnapshotError(f"{task.name} cannot have an attribute {short_repr(name)} from a snapshot")
        if name in declared:
            value = check_parameter_value(task, declared[name], value)
        setattr(task, check_attribute(type(task), name), value)
    for ticker, plain in zip(task.tickers, state.tickers, strict=True):
        _restore_ticker(ticker, *reader.from_plain_value(plain))
    restore_pushed_parameters(task, reader.from_plain_value(state.pushed))


def _restore_ticker(ticker: Ticker, hertz: float, count: int, start: int, missed: int, timer: Any) -> None:
    """Continue a ticker. A forged one could tick without time passing, or call another's function."""
    fits = hertz <= HIGHEST_RATE and count >= 0 and missed >= 0 and (timer is None) == (not hertz > 0.0)
    if not fits or (timer is not None and timer.time != start + round(count * SECOND / hertz)):
        raise SnapshotError("not a valid snapshot: a periodic method does not tick at its rate")
    ticker.restore(hertz, count, start, missed, timer)


def restore_pushed_parameters(task: Task, pushed: Iterable[Mapping[str, Any]]) -> None:
    """Restore the values that `push` has remembered. Raises SnapshotError."""
    task.parameter_set.pushed.clear()
    task.parameter_set.pushed.extend(check_parameter_values(task, values) for values in pushed)


def check_parameter_values(task: Task, values: Mapping[str, Any]) -> dict[str, Any]:
    """Values of parameters by ini name, within their limits. Raises SnapshotError."""
    declarations = task.parameter_set.declarations
    if unknown := values.keys() - declarations.keys():
        raise SnapshotError(f"{task.name} has no parameter {short_repr(min(unknown))}")
    return {name: check_parameter_value(task, declarations[name], value) for name, value in values.items()}


def check_parameter_value(task: Task, parameter: Parameter, value: Any) -> Any:
    """The value of a parameter, if it is within its limits. Raises SnapshotError."""
    try:
        return parameter.check(value)
    except (ValueError, TypeError) as error:
        raise SnapshotError(f"{task.name}: {parameter.name}: {str(error)[:200]}") from None


def restore_timer(timer: Timer, state: TimerState, reader: StateReader) -> None:
    """Give a timer its owner, function and arguments. Raises SnapshotError."""
    owner, function = reader.from_plain_value(state.owner), reader.from_plain_value(state.function)
    if not isinstance(owner, (Task, Vehicle, Bus)) or not isinstance(function, (MethodType, partial)):
        raise SnapshotError("not a valid snapshot: a pending call is not one of a task")
    timer.owner, timer.function = owner, cast(Any, function)
    timer.args = tuple(reader.from_plain_value(word) for word in state.args)


def writer_for(vehicle: Vehicle, timers: list[Timer]) -> StateWriter:
    """Writes states that refer to pending calls by their index in `timers`."""
    places = {id(timer): index for index, timer in enumerate(timers)}
    return StateWriter(lambda value: _name(value, vehicle, places), _vocabulary(vehicle))


def reader_for(vehicle: Vehicle, timers: list[Timer]) -> StateReader:
    """Reads what `writer_for` wrote."""
    return StateReader(lambda words: _find(words, vehicle, timers), _vocabulary(vehicle))


def _vocabulary(vehicle: Vehicle) -> ClassAllowlist:
    return ClassAllowlist({type(task).__module__.partition(".")[0] for task in vehicle.tasks}, vehicle.bus.messages)


def do_nothing() -> None:
    """The function of a timer that is not restored yet."""


def _kind(task: Task) -> str:
    return f"{type(task).__module__}:{type(task).__qualname__}"


def _subscription_state(task: Task, subscription: Subscription, writer: StateWriter) -> SubscriptionState:
    handler = subscription.handler
    if not isinstance(handler, MethodType) or handler.__self__ is not task:
        raise SnapshotError(
            f"{task.name} receives {subscription.type.__name__} with {handler!r}, which is not one of its methods"
        )
    kind = writer.to_plain_value(subscription.type, task.name)
    return SubscriptionState(kind, handler.__name__, subscription.others, subscription.packets)


def _name(value: object, vehicle: Vehicle, timers: dict[int, int]) -> list[Any] | None:
    """The name of a value that belongs to the vehicle; None for any other value."""
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
        if not value.done:
            raise SnapshotError(f"{value.task.name} runs a script, which is not in its journal")
        return ["ended", value.task.name]
    if isinstance(value, MethodType) and value.__self__ is vehicle and value.__name__ in OF_VEHICLE:
        return ["vehicle's", value.__name__]
    return next(([name] for name, part in shared_parts(vehicle) if part is value), None)


def shared_parts(vehicle: Vehicle) -> Iterator[tuple[str, object]]:
    """The objects that all tasks of a vehicle share, by name."""
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
            over = Timer(0, do_nothing, ())
            over.cancel()
            return over
        case ["ticker", str(name), int(index)]:
            return vehicle.task(name).tickers[index]
        case ["ended", str(name)]:
            return Script.create_ended_script(vehicle.task(name))
        case ["vehicle's", str(name)] if name in OF_VEHICLE:
            return getattr(vehicle, name)
        case [str(name)] if (part := dict(shared_parts(vehicle)).get(name)) is not None:
            return part
        case _:
            raise SnapshotError(f"not a valid snapshot: {short_repr(words[0])} is unknown")
