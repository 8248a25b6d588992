"""One queue of events and the clock that it runs on."""

from runtime.kernel.clock import SECOND, VirtualClock, WallClock, nanoseconds, parse_clock
from runtime.kernel.kernel import LIVELOCK_EVENTS, Kernel, LivelockError
from runtime.kernel.timer import Readable, Timer, owner_of

__all__ = [
    "LIVELOCK_EVENTS",
    "SECOND",
    "Kernel",
    "LivelockError",
    "Readable",
    "Timer",
    "VirtualClock",
    "WallClock",
    "nanoseconds",
    "owner_of",
    "parse_clock",
]
