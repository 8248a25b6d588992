"""Wall, scaled and virtual time, in integer nanoseconds since 1970 UTC, and the contract that all clocks keep."""

import math
import time
from collections.abc import Callable
from typing import Protocol

SECOND = 1_000_000_000
LONGEST_WAIT = 3600.0  # s; epoll takes no more than 24 days


def nanoseconds(seconds: float) -> int:
    """A time in seconds as nanoseconds; `round(seconds * 1e9)` would be off by hundreds of them."""
    whole = math.floor(seconds)
    return whole * SECOND + round((seconds - whole) * SECOND)


class Clock(Protocol):
    """Where a kernel takes its time from. Times are ns since 1970 UTC and never go back.

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
    """The computer's time, run `speed` times as fast from the moment of construction.

    It follows the monotonic clock from a start that is read once, so steps of the system time do not reach the tasks.
    `start` (ns since 1970) sets that start; None takes the present.
    """

    virtual = False

    def __init__(self, speed: float = 1.0, start: int | None = None):
        if not 0.0 < speed < 1e6:
            raise ValueError(f"a clock cannot run at {speed} times real time")
        self.speed = speed
        self._start = time.time_ns() if start is None else start
        self._zero = time.monotonic_ns()

    def read(self) -> int:
        passed = time.monotonic_ns() - self._zero
        return self._start + (passed if self.speed == 1.0 else round(passed * self.speed))

    def advance(self, target: int | None, wait: Callable[[float], object]) -> int:
        if target is None:
            wait(LONGEST_WAIT)
        else:
            wait(min(LONGEST_WAIT, max(0.0, (target - self.read()) / self.speed / SECOND)))
        return self.read()


class VirtualClock:
    """Time that passes only when nothing is left to do at the present moment, and then without waiting."""

    virtual = True
    speed = math.inf

    def __init__(self, start: int = 0):
        self._now = start

    def read(self) -> int:
        return self._now

    def advance(self, target: int | None, wait: Callable[[float], object]) -> int | None:
        if target is None:
            return None
        self._now = max(self._now, target)
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
        return WallClock(speed=float(word.removesuffix("x")))
    except ValueError:
        raise ValueError(f"no such clock: {text!r}; use real, virtual, or a factor such as 10x") from None
