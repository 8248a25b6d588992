"""Context of a scenario's run: its vehicles, their common time, and what watches them."""

from collections.abc import Callable, Hashable, Mapping
from typing import TYPE_CHECKING, Protocol

from runtime.fault_injection import FaultInjector
from runtime.kernel import SECOND, Kernel
from runtime.vehicle import Fleet, Vehicle
from shoal.scenarios.message_monitor import MessageMonitor, MessageSlots
from shoal.scenarios.scenario_condition import ScenarioCondition

if TYPE_CHECKING:
    from shoal.scenarios.links import LinkChannel


class RunContext:
    """The vehicles of a run by name, built and not yet started, and their kernel; `warnings` are for the result.

    `channels` are their links by name, `pending_events` explains missing events, `temporary_values` the
    values that events have set, `event_watchers` what to call just before an event with a name happens.
    """

    def __init__(self, fleet: Fleet, vehicles: Mapping[str, Vehicle], seed: int):
        self.fleet = fleet
        self.vehicles = vehicles
        self.seed = seed
        self.monitor: MessageMonitor = MessageMonitor(vehicles)
        self.channels: dict[str, LinkChannel] = {}
        self.pending_events: dict[object, str] = {}
        self.warnings: list[str] = []
        self.temporary_values: TemporaryValues = TemporaryValues()
        self.event_watchers: dict[str, list[Callable[[], object]]] = {}
        self._faults: dict[str, FaultInjector] = {}
        self._start_ns = fleet.kernel.now_ns

    @property
    def kernel(self) -> Kernel:
        return self.fleet.kernel

    @property
    def time(self) -> float:
        """The time since the start of the run (s)."""
        return (self.fleet.kernel.now_ns - self._start_ns) / SECOND

    def faults(self, vehicle: str) -> FaultInjector:
        """The faults of a vehicle in this run."""
        if vehicle not in self._faults:
            self._faults[vehicle] = FaultInjector(self.vehicles[vehicle])
        return self._faults[vehicle]

    def ineffective_faults(self) -> list[str]:
        """The faults that have changed nothing so far."""
        return [text for faults in self._faults.values() for text in faults.unused_faults]

    def call_at(self, seconds: float, function: Callable[[], object]) -> None:
        """Call a function at a time of the run (s)."""
        self.kernel.at(self._start_ns + round(seconds * SECOND), function)

    def call_when(self, condition: ScenarioCondition, function: Callable[[], object], times: float = 1) -> None:
        """Call a function when a condition begins to hold, at most so many times.

        Raises ValueError for unknown entities.
        """
        trigger = _Trigger(condition, function, times)
        (trigger.seen,) = self.monitor.add_subscriber([condition.selectors], trigger.update)

    def stop(self) -> None:
        """End the run."""
        self.fleet.stop()


class TemporaryValues:
    """Values that events set for a while: the latest one counts, and after all of them what was there before."""

    def __init__(self) -> None:
        self._before: dict[Hashable, str] = {}
        self._held: dict[Hashable, dict[object, str]] = {}

    def hold_value(self, what: Hashable, holder: object, value: str, before: str) -> None:
        """`holder` sets a value; `before` is the present one."""
        if not self._held.get(what):
            self._before[what] = before
        self._held.setdefault(what, {})[holder] = value

    def release_value(self, what: Hashable, holder: object) -> str:
        """The value that counts without that of `holder`."""
        held = self._held[what]
        del held[holder]
        return next(reversed(held.values()), self._before[what])


class Event(Protocol):
    """An event of a run."""

    def schedule(self, context: RunContext) -> None:
        """Prepare it, before the vehicles start. The state of one run is kept in objects of its own."""
        ...


class _Trigger:
    transient = True

    def __init__(self, condition: ScenarioCondition, function: Callable[[], object], times: float):
        self._condition = condition
        self._function = function
        self._left = times
        self._held = False
        self.seen: MessageSlots = []

    def update(self, _: float) -> None:
        if self._left <= 0:
            return
        held, self._held = self._held, self._condition.holds(self.seen)
        if self._held and not held:
            self._left -= 1
            self._function()
