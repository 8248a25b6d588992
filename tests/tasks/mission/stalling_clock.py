"""A wall clock for tests: time passes as on a computer that is fast enough, and jumps where it stands still."""

from collections.abc import Callable

import pytest

from runtime.kernel import SECOND, kernel
from runtime.vehicle import realtime_lag


class StallingClock:
    """Time that never waits and is not virtual: ticks are merged, timers are late.

    `stalls` are (seconds from the start, length in seconds). In `overload` (begin and end, s from the start) every
    moment comes `delay` s late, and every call takes `cost` s, as on a computer that others keep busy.
    """

    virtual = False
    speed = 20.0  # not 1: that would be compared with the system's time

    def __init__(self, start, stalls=(), *, overload=(0.0, 0.0), delay=0.0, cost=0.0):
        self.start = self.time = start
        self.stalls = sorted((start + round(at * SECOND), round(length * SECOND)) for at, length in stalls)
        self._overload = tuple(start + round(at * SECOND) for at in overload)
        self._delay = round(delay * SECOND)
        self._cost = round(cost * SECOND)

    def read(self) -> int:
        if self._cost and self._overload[0] <= self.time < self._overload[1]:
            self.time += self._cost
        return self.time

    def advance(self, target: int | None, wait: Callable[[float], object]) -> int:
        far = target is None or target > self.time + SECOND // 10
        wait(0.001 if far else 0.0)  # for what threads return
        self.time = self.time + SECOND // 10 if target is None or far else max(self.time, target)
        if self._overload[0] <= self.time < self._overload[1]:
            self.time += self._delay
        while self.stalls and self.time >= self.stalls[0][0]:
            self.time += self.stalls.pop(0)[1]
        return self.time

    def measure_computer(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Have the kernel and the vehicle measure the computer by this clock: else a busy one changes the run."""
        for module in (kernel, realtime_lag):
            monkeypatch.setattr(module, "time", _Computer(self))


class _Computer:
    """Stands for the module `time`: real time passes with a clock, and no call takes any of it."""

    def __init__(self, clock: StallingClock):
        self._clock = clock

    def monotonic_ns(self) -> int:
        return round(self._clock.time / self._clock.speed)

    def monotonic(self) -> float:
        return self.monotonic_ns() / SECOND

    def perf_counter_ns(self) -> int:
        return 0

    thread_time_ns = perf_counter_ns
