"""Shutdown: in order on the first signal, immediate on the second, never later than the deadline."""

import contextlib
import os
import signal
import sys
import time
import traceback
from collections.abc import Callable, Generator
from types import FrameType
from typing import NoReturn

from runtime.kernel import Watchdog, event_queue, kernel
from runtime.vehicle import Vehicle
from runtime.vehicle import vehicle as vehicle_module

STOPPING_TIME = 0.8  # s from a signal to the end, even if something hangs
SAME_STOP = 1.0  # s
STOPPING = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
OWN_FILES = (kernel.__file__, event_queue.__file__, vehicle_module.__file__)


@contextlib.contextmanager
def shutdown_on_signal(vehicle: Vehicle) -> Generator[Watchdog]:
    """Name what hangs in a run, and let signals end it: the first in order, within a second, a later one at once."""
    watchdog = Watchdog(vehicle.kernel, _exit_now)
    stop = _signal_handler(vehicle, watchdog)
    previous = {n: signal.signal(n, stop) for n in STOPPING if signal.getsignal(n) is not signal.SIG_IGN}
    try:
        with watchdog:
            yield watchdog
    finally:
        if (
            not watchdog.breaks_handlers
        ):  # after a signal the process ends: one of the same stop must not kill it meanwhile
            for number, handler in previous.items():
                signal.signal(number, handler)


def exit_process(watchdog: Watchdog, status: int) -> NoReturn:
    """Exit; after a signal without the end of the interpreter, which takes long on a busy computer."""
    if watchdog.breaks_handlers:
        with contextlib.suppress(OSError):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(status)
    sys.exit(status)


def traceback_without_library(error: Exception) -> str:
    """The traceback without the frames between the command line and the task."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None and trace.tb_frame.f_code.co_filename != kernel.__file__:
        trace = trace.tb_next
    while trace is not None and trace.tb_next is not None and trace.tb_frame.f_code.co_filename in OWN_FILES:
        trace = trace.tb_next
    return "".join(traceback.format_exception(type(error), error, trace)).rstrip()


def _signal_handler(vehicle: Vehicle, watchdog: Watchdog) -> Callable[[int, FrameType | None], None]:
    """A signal handler: the first signal ends the run in order, one more than SAME_STOP later immediately.

    Until then it is the same stop: `timeout` and systemd signal a process and its group. SIGHUP never ends it at once.
    """
    asked: list[float] = []

    def stop(number: int, _: FrameType | None) -> None:
        asked.append(time.monotonic())
        if len(asked) == 1:
            vehicle.kernel.post(vehicle.stop)
            watchdog.set_stop_deadline(STOPPING_TIME, hasty=True)
        elif asked[-1] - asked[0] > SAME_STOP and signal.Signals(number).name != "SIGHUP":
            _exit_now("stopped by a second signal")

    return stop


def _exit_now(text: str) -> NoReturn:
    """End the process at once, from any thread: nothing is closed; logs have what was written until their last flush.

    Only calls of the operating system: a stream of Python may be locked by what hangs.
    """
    for stream, data in ((1, b"\x1b[?25h"), (2, f"shoal: {text}\n".encode())):  # the first shows the cursor again
        with contextlib.suppress(OSError):
            if stream == 2 or os.isatty(stream):
                os.set_blocking(stream, False)
                os.write(stream, data)
    os._exit(1)
