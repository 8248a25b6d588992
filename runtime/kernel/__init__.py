"""One queue of events and the clock that it runs on."""

from runtime.kernel.clock import SECOND, Clock, ScaledClock, VirtualClock, WallClock, nanoseconds, parse_clock
from runtime.kernel.errors import Blocked, HandlerError, LivelockError, SimulatedCrash, as_error
from runtime.kernel.kernel import LIVELOCK_EVENTS, Kernel
from runtime.kernel.observer import KernelInstrument
from runtime.kernel.timer import Readable, Timer, handler_of, owner_of, title
from runtime.kernel.watchdog import Watchdog

__all__ = [
    "LIVELOCK_EVENTS",
    "SECOND",
    "Blocked",
    "Clock",
    "HandlerError",
    "Kernel",
    "KernelInstrument",
    "LivelockError",
    "Readable",
    "ScaledClock",
    "SimulatedCrash",
    "Timer",
    "VirtualClock",
    "WallClock",
    "Watchdog",
    "as_error",
    "handler_of",
    "nanoseconds",
    "owner_of",
    "parse_clock",
    "title",
]
