"""Begins and ends the faults of a vehicle's tasks, and reports each to the log book."""

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from runtime.fault_injection.fault_kinds import Fault, FaultError
from runtime.fault_injection.interceptor import PublishInterceptor
from runtime.kernel import nanoseconds
from runtime.vehicle import Vehicle
from support.terminal_text import quoted, with_suggestion


@dataclass(frozen=True)
class Injection:
    """A fault of a task (its section), from `start` (s from the start of the run), for `duration` (s)."""

    fault: Fault
    start: float = 0.0
    duration: float = math.inf
    task: str = ""


class FaultInjector:
    """The faults of one vehicle. Several may overlap on a task: they act in the order in which they began.

    The Daemon logs when each begins and ends. A run with faults is as deterministic as one without.
    A task that has a fault, or will have one that is stuck, cannot be in a snapshot.
    """

    def __init__(self, vehicle: Vehicle):
        self._vehicle = vehicle
        self._sources: dict[str, PublishInterceptor] = {}
        self._begun = Counter[str]()
        self._spoils: list[tuple[PublishInterceptor, object, str]] = []

    @property
    def unused_faults(self) -> list[str]:
        """The faults that have begun and changed nothing: the task has published nothing that they concern."""
        return [text for source, spoil, text in self._spoils if id(spoil) not in source.acted]

    def prepare_fault(self, task: str, fault: Fault) -> None:
        """Prepare for a fault that comes later: one that repeats values needs the values before it.

        Raises FaultError if there is no such task, or it cannot have this fault.
        """
        source = self._source(task)
        fault.check(self._vehicle.bus.messages)
        source.keeps_last |= fault.needs_last
        source.attach_or_detach()

    def schedule(self, injection: Injection) -> None:
        """Begin and end a fault at its times; call it when the vehicle is started. Raises FaultError like `prepare`."""
        self.prepare_fault(injection.task, injection.fault)
        at = nanoseconds(self._vehicle.start_time + injection.start)
        begin = self._vehicle.kernel.at(at, self.begin, injection.task, injection.fault, injection.duration)
        begin.owner = self._vehicle

    def begin(self, task: str, fault: Fault, lasting: float = math.inf, where: str = "") -> Callable[[], None]:
        """Begin a fault now; it ends after so many seconds, or when the function that is returned is called.

        `where` is the place in a file that asks for it, for people. Raises FaultError like `prepare`.
        """
        self.prepare_fault(task, fault)
        source, log = self._sources[task], self._vehicle.daemon.log
        spoil = fault.begin(source, self._begun[task])
        self._begun[task] += 1
        if spoil is not None:
            source.filters.append(spoil)
            self._spoils.append((source, spoil, f"{where and f'{where}: '}fault of {task}: {fault}"))
        source.attach_or_detach()
        ended = False

        def end() -> None:
            nonlocal ended
            if ended:
                return
            ended = True
            if spoil is not None:
                source.filters.remove(spoil)
            fault.end(source)
            source.attach_or_detach()
            log.warning(f"fault of {task} ends: {fault}")

        lasts = math.isfinite(lasting)
        log.warning(f"fault of {task}: {fault}" + (f", for {lasting:g} s" if lasts else ""))
        if lasts:
            self._vehicle.kernel.after(lasting, end).owner = self._vehicle
        elif fault.momentary:
            fault.end(source)
            ended = True
        return end

    def _source(self, task: str) -> PublishInterceptor:
        source = self._sources.get(task)
        if source is None:
            names = [one.name for one in self._vehicle.tasks]
            if task not in names:
                raise FaultError(with_suggestion(f"there is no task {quoted(task)}", task, names))
            source = self._sources[task] = PublishInterceptor(self._vehicle.task(task))
        return source
