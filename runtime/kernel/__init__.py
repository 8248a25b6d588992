"""One queue of events and the clock that it runs on."""

from runtime.kernel.clock import (
    SECOND,
    Clock,
    ScaledClock,
    VirtualClock,
    WallClock,
    nanoseconds,
    parse_clock,
    real_time_scale,
)
from runtime.kernel.errors import (
    HandlerBlockedError,
    HandlerError,
    LivelockError,
    SimulatedCrash,
    to_ordinary_exception,
)
from runtime.kernel.event_queue import EventQueue
from runtime.kernel.kernel import LIVELOCK_EVENTS, Kernel
from runtime.kernel.observer import KernelObserver
from runtime.kernel.timer import Readable, Timer, handler_name, owner_of, owner_title
from runtime.kernel.watchdog import Watchdog

__all__ = [
    "LIVELOCK_EVENTS",
    "SECOND",
    "Clock",
    "EventQueue",
    "HandlerBlockedError",
    "HandlerError",
    "Kernel",
    "KernelObserver",
    "LivelockError",
    "Readable",
    "ScaledClock",
    "SimulatedCrash",
    "Timer",
    "VirtualClock",
    "WallClock",
    "Watchdog",
    "handler_name",
    "nanoseconds",
    "owner_of",
    "owner_title",
    "parse_clock",
    "real_time_scale",
    "to_ordinary_exception",
]
