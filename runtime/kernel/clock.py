"""Wall, scaled and virtual time, in integer nanoseconds since 1970 UTC."""

import math
import time

SECOND = 1_000_000_000


def nanoseconds(seconds: float) -> int:
    """Nanoseconds of a time in seconds, exact where the float is; the product of both would be off by some hundred."""
    whole = math.floor(seconds)
    return whole * SECOND + round((seconds - whole) * SECOND)


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

    def wait(self, until: int) -> float:
        """Real seconds until the clock reads `until`."""
        return max(0.0, (until - self.read()) / self.speed / SECOND)


class VirtualClock:
    """Time that passes only when there is nothing left to do at the present moment."""

    virtual = True
    speed = float("inf")

    def __init__(self, start: int = 0):
        self._now = start

    def read(self) -> int:
        return self._now

    def set(self, time_ns: int) -> int:
        self._now = time_ns
        return time_ns


def parse_clock(text: str, start: int) -> WallClock | VirtualClock:
    """The clock that `real`, `virtual` or a factor such as `10x` names; a virtual one begins at `start` (ns).

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
