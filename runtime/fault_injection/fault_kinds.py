"""The kinds of faults: what each does to what a task publishes."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar, cast
from zlib import crc32

import imc
from imc.layout import NUMBERS
from runtime.bus import Frame
from runtime.fault_injection.interceptor import Item, PublishFilter, PublishInterceptor
from runtime.kernel import SimulatedCrash
from support.terminal_text import quoted, with_suggestion

ABOUT_ITSELF = (
    imc.EntityActivationState,
    imc.EntityInfo,
    imc.EntityList,
    imc.EntityParameters,
    imc.EntityState,
    imc.LogBookEntry,
)
FULL_TURN = 2.0 * math.pi
LARGEST = {"fp32_t": 3.4028234663852886e38, "fp64_t": math.inf}


class FaultError(ValueError):
    """The task cannot have this fault; the text gives the reason."""


@dataclass(frozen=True)
class Fault:
    """A fault of a task; a value without a time, which can be used for several tasks.

    Its text is a word or two for the log book. One with `needs_last` needs what the task has published before; one that
    is `momentary` is over at once, unless it lasts for some time.
    """

    needs_last: ClassVar[bool] = False
    momentary: ClassVar[bool] = False

    def check(self, schema: imc.Schema) -> None:
        """Raise FaultError if a vehicle with these messages cannot have this fault."""

    def begin(self, source: PublishInterceptor, number: int) -> PublishFilter | None:
        """The effect on each message and frame of a task, from now on; None for nothing.

        `number` counts the faults that the task has had.
        """
        return None

    def end(self, source: PublishInterceptor) -> None:
        """Undo what `begin` has done besides."""


@dataclass(frozen=True)
class Silent(Fault):
    """The task publishes nothing; with `of`, nothing of the messages of these names.

    Without `of`, the state, the parameters and the log book of the task still arrive: its device is broken, its program
    is not.
    """

    of: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"silent{_listed(self.of)}"

    def check(self, schema: imc.Schema) -> None:
        _check_names(schema, self.of)

    def begin(self, source: PublishInterceptor, number: int) -> PublishFilter:
        concerns = _concerned(self.of)
        return lambda item: None if concerns(item) else item


@dataclass(frozen=True)
class Stuck(Fault):
    """The task repeats its last values with fresh time stamps; with `of`, only in the messages of these names.

    Those of each message, entity and number (`id`, as of a servo) are its own; what the task has not published before
    stays as it is the first time. A camera repeats its picture. What a task reports of itself continues, as with
    Silent.
    """

    of: tuple[str, ...] = ()
    needs_last: ClassVar[bool] = True

    def __str__(self) -> str:
        return f"stuck{_listed(self.of)}"

    def check(self, schema: imc.Schema) -> None:
        _check_names(schema, self.of)

    def begin(self, source: PublishInterceptor, number: int) -> PublishFilter:
        concerns, kept = _concerned(self.of), dict(source.last)

        def repeat(item: Item) -> Item:
            if not concerns(item):
                return item
            old = kept.setdefault(source.sensor_key(item), item)
            if isinstance(item, Frame):
                return replace(cast(Frame, old), time=item.time, index=item.index)
            header = {"timestamp": item.timestamp, "src": item.src, "dst": item.dst, "dst_ent": item.dst_ent}
            return cast(imc.Message, old).replace(**header)

        return repeat


@dataclass(frozen=True)
class Biased(Fault):
    """A field of a message is wrong by a constant in its unit: `Biased("GpsFix", "lat", 1e-4)`.

    A field that the definition of the message limits stays within: an angle of a full turn goes round, other values
    stop at the limit. An integer is rounded, and stops where its type ends. NaN stays NaN.
    """

    of: str
    field: str
    by: float

    def __str__(self) -> str:
        return f"biased, {self.of}.{self.field} by {self.by:g}"

    def check(self, schema: imc.Schema) -> None:
        if math.isnan(self.by) and not _field(schema, self.of, self.field).type.startswith("fp"):
            raise FaultError(f"{self.of}.{self.field} is an integer, and cannot be NaN")
        _field(schema, self.of, self.field)

    def begin(self, source: PublishInterceptor, number: int) -> PublishFilter:
        return _shifting(source, self.of, self.field, lambda: self.by)


@dataclass(frozen=True)
class Noisy(Fault):
    """A field of a message has normally distributed noise of this standard deviation, in its unit, besides its own.

    Limits are those of Biased. The noise follows from the seed of the vehicle, the task, the field and how many faults
    the task has had; that of others is not changed.
    """

    of: str
    field: str
    deviation: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.deviation) and self.deviation >= 0.0):
            raise FaultError(f"a standard deviation is at least 0, not {self.deviation:g}")

    def __str__(self) -> str:
        return f"noisy, {self.of}.{self.field} by {self.deviation:g}"

    def check(self, schema: imc.Schema) -> None:
        _field(schema, self.of, self.field)

    def begin(self, source: PublishInterceptor, number: int) -> PublishFilter:
        from numpy.random import PCG64, Generator, SeedSequence

        task = source.task
        names = (task.system_name, task.name, "noise", f"{self.of}.{self.field}")
        words = [task.vehicle.seed, *(crc32(name.encode()) for name in names), number]
        random = Generator(PCG64(SeedSequence(words)))
        return _shifting(source, self.of, self.field, lambda: random.normal(0.0, self.deviation))


@dataclass(frozen=True)
class Crash(Fault):
    """The task raises SimulatedCrash, and restarts with back-off, as on a vehicle; until the end each start fails."""

    momentary: ClassVar[bool] = True

    def __str__(self) -> str:
        return "crash"

    def begin(self, source: PublishInterceptor, number: int) -> None:
        task = source.task
        source.crashes += 1
        vars(task)["start"] = _crash
        task.vehicle.kernel.after(0.0, _crash).owner = task

    def end(self, source: PublishInterceptor) -> None:
        source.crashes -= 1
        if not source.crashes:
            del vars(source.task)["start"]


def _crash() -> None:
    raise SimulatedCrash("crashed on purpose")


def _listed(names: tuple[str, ...]) -> str:
    return f", {', '.join(names)}" if names else ""


def _concerned(names: tuple[str, ...]) -> Callable[[Item], bool]:
    if names:
        return lambda item: type(item).__name__ in names
    return lambda item: not isinstance(item, ABOUT_ITSELF)


def _check_names(schema: imc.Schema, names: tuple[str, ...]) -> None:
    for name in names:
        if name not in schema and name != Frame.__name__:
            raise FaultError(with_suggestion(f"there is no message {quoted(name)}", name, schema.types))


def _field(schema: imc.Schema, message: str, name: str) -> imc.FieldInfo:
    """A field that is a number. Raises FaultError."""
    if message not in schema:
        raise FaultError(with_suggestion(f"there is no message {quoted(message)}", message, schema.types))
    infos = {info.name: info for info in schema.fields(schema[message])}
    info = infos.get(name)
    if info is None:
        raise FaultError(with_suggestion(f"{message} has no field {quoted(name)}", name, infos))
    if info.enum is not None or info.type not in NUMBERS:
        raise FaultError(f"{message}.{name} is not a number")
    return info


def _range(kind: str) -> tuple[float, float]:
    """The least and largest value of a field's type."""
    if kind in LARGEST:
        return -LARGEST[kind], LARGEST[kind]
    bits, signed = int(kind.strip("uint_")), not kind.startswith("u")
    return (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if signed else (0, 2**bits - 1)


def _shifting(source: PublishInterceptor, message: str, name: str, step: Callable[[], float]) -> PublishFilter:
    info = _field(source.task.vehicle.bus.messages, message, name)
    least, most = _range(info.type)
    low = least if info.minimum is None else max(least, info.minimum)
    high = most if info.maximum is None else min(most, info.maximum)
    turns = info.unit == "rad" and math.isclose(high - low, FULL_TURN)
    rounds = not info.type.startswith("fp")

    def shift(item: Any) -> Item:
        if type(item).__name__ != message:
            return item
        value = getattr(item, name) + step()
        if turns and not low <= value <= high:
            value = low + (value - low) % FULL_TURN
        elif value < low or value > high:
            value = low if value < low else high
        return item.replace(**{name: round(value) if rounds else value})

    return shift
