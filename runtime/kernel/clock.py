"""Wall, scaled and virtual time, in integer nanoseconds since 1970 UTC, and the contract that all clocks keep."""

import math
import time
from collections.abc import Callable
from typing import Protocol

SECOND = 1_000_000_000
LONGEST_WAIT = 3600.0  # s; epoll takes no more than 24 days
LONGEST_LAG = SECOND  # ns of real time that a scaled clock makes up for after the computer was too slow


def nanoseconds(seconds: float) -> int:
    """A time in seconds as nanoseconds; `round(seconds * 1e9)` would be off by hundreds of them."""
    whole = math.floor(seconds)
    return whole * SECOND + round((seconds - whole) * SECOND)


def real_time_scale(clock: "Clock") -> float:
    """Seconds of a clock in one second of real time; 1 for a virtual clock, which has no such pace."""
    return clock.speed if clock.speed < math.inf else 1.0


class Clock(Protocol):
    """The source of a kernel's time. Times are ns since 1970 UTC and never go back.

    `virtual` is whether time stands still while handlers run. Ticks are then never merged, and tasks that need the
    network (`external`) are skipped. A simulator that steps its own time can be such a clock: its `advance` returns as
    soon as a step ends, at the time of that step, and what the simulator measured is brought in with `kernel.post`.
    """

    @property
    def virtual(self) -> bool: ...

    @property
    def speed(self) -> float:
        """Seconds of this clock per second of real time; infinite if it does not wait."""
        ...

    def read(self) -> int:
        """The present time."""
        ...

    def advance(self, target: int | None, wait: Callable[[float], object]) -> int | None:
        """Let time pass until `target`, the next moment at which the kernel has something to do; return the time.

        None as `target` means that nothing is due. The time may be earlier than `target`: the kernel then looks for
        what has arrived, and asks again. It is never later on a virtual clock. `wait(seconds)` blocks until a socket
        or another thread wakes the kernel, at most that long in real time. None is returned if no time will ever pass;
        the run then ends.
        """
        ...


class WallClock:
    """The computer's time.

    It follows the monotonic clock from a start that is read once, so steps of the system time do not reach the tasks.
    `start` (ns since 1970) sets that start; None takes the present.
    """

    virtual = False
    speed: float = 1.0

    def __init__(self, start: int | None = None):
        self._offset = (time.time_ns() if start is None else start) - time.monotonic_ns()

    def read(self) -> int:
        return self._offset + time.monotonic_ns()

    def advance(self, target: int | None, wait: Callable[[float], object]) -> int:
        wait(LONGEST_WAIT if target is None else min(LONGEST_WAIT, max(0.0, (target - self.read()) / SECOND)))
        return self.read()


class ScaledClock:
    """Time that passes `speed` times as fast as real time, or as fast as the computer can: it gives way.

    It stands still while handlers run and never passes the next moment at which something is due, so no tick is ever
    late or merged with another. What it falls behind real time it makes up for, up to `LONGEST_LAG`. `start` is in ns
    since 1970; None takes the present.
    """

    virtual = False

    def __init__(self, speed: float, start: int | None = None):
        if not 1e-3 <= speed < 1e6:
            raise ValueError(f"a clock cannot run at {speed} times real time")
        self.speed = speed
        self._now = self._reference = time.time_ns() if start is None else start
        self._zero: int | None = None  # the monotonic time at `_reference`; the first wait sets it

    def read(self) -> int:
        return self._now

    def advance(self, target: int | None, wait: Callable[[float], object]) -> int:
        if self._zero is None:
            self._zero = time.monotonic_ns()
        ahead = LONGEST_WAIT if target is None else (target - self._pace(self._zero)) / self.speed / SECOND
        wait(min(LONGEST_WAIT, max(0.0, ahead)))
        present = self._pace(self._zero)
        if target is not None and present > target:
            if (present - target) / self.speed > LONGEST_LAG:
                self._reference, self._zero = target, time.monotonic_ns() - LONGEST_LAG
            present = target
        self._now = max(self._now, present)
        return self._now

    def _pace(self, zero: int) -> int:
        """The time on a computer that is fast enough."""
        return self._reference + round((time.monotonic_ns() - zero) * self.speed)


class VirtualClock:
    """Time that passes only when nothing is left to do at the present moment, and then without waiting."""

    virtual = True
    speed: float = math.inf

    def __init__(self, start: int = 0):
        self._now = start

    def read(self) -> int:
        return self._now

    def advance(self, target: int | None, wait: Callable[[float], object]) -> int | None:
        if target is None:
            return None
        if target > self._now:
            self._now = target
        return self._now


def parse_clock(text: str, start: int) -> Clock:
    """The clock for `real`, `virtual` or a factor such as `10x`; a virtual one begins at `start` (ns).

    Raises ValueError for anything else.
    """
    word = text.strip().lower()
    if word == "real":
        return WallClock()
    if word == "virtual":
        return VirtualClock(start)
    try:
        return ScaledClock(float(word.removesuffix("x")))
    except ValueError:
        raise ValueError(f"no such clock: {text!r}; use real, virtual, or a factor such as 10x") from None
