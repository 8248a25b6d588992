"""One queue of events and the clock that it runs on."""

from runtime.kernel.clock import SECOND, Clock, VirtualClock, WallClock, nanoseconds, parse_clock
from runtime.kernel.kernel import LIVELOCK_EVENTS, Kernel, KernelInstrument, LivelockError
from runtime.kernel.timer import Readable, Timer, owner_of

__all__ = [
    "LIVELOCK_EVENTS",
    "SECOND",
    "Clock",
    "Kernel",
    "KernelInstrument",
    "LivelockError",
    "Readable",
    "Timer",
    "VirtualClock",
    "WallClock",
    "nanoseconds",
    "owner_of",
    "parse_clock",
]
