"""Watches a kernel from its own thread: reports what blocks it, breaks endless loops, and ends a stop that hangs."""

import contextlib
import ctypes
import faulthandler
import linecache
import logging
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import FrameType, TracebackType

from runtime.kernel.errors import HandlerBlockedError
from runtime.kernel.kernel import Kernel
from runtime.kernel.timer import Timer, handler_name, owner_of, owner_title

PERIOD = 0.1  # s
NAMED_AFTER = 2.0  # s
BROKEN_AFTER = 5.0  # s; longer than what a slow disk or a busy machine costs a handler
HOPELESS_AFTER = 30.0  # s
HASTE = 0.4  # s, in the place of `BROKEN_AFTER` once the end is expected
LONGEST_SLEEP = 1.0  # s between two looks, of which more does not count
STANDSTILL = 5.0  # s without an event on a virtual clock
CALLS = {f.__code__ for f in (Kernel._make_calls, Kernel._run_moment, Kernel.drain)}  # pyright: ignore[reportPrivateUsage]
RUNTIME = str(Path(__file__).parents[1])
DEBUGGERS = ("bdb", "pdb", "pydevd", "_pydevd_bundle.pydevd")

logger: logging.Logger = logging.getLogger("shoal.kernel")


class Watchdog:
    """Watches the kernel that the present thread runs, while its `with` block lasts.

    After 2 s in one handler it names the handler and the line in it. On a wall clock, an exception is raised in the
    handler after `BROKEN_AFTER`, so that its task fails like any other; the exception arrives as soon as Python code
    runs. A call into a library that has not returned after `HOPELESS_AFTER` is given up: `on_hopeless` is called with
    a text, from the watchdog's thread. A virtual clock only gets warnings, also if the clock itself stands still.
    The time in which a handler waits for a processor that others use does not count, nor does that of a halted process.

    After `set_stop_deadline(seconds)`, which a signal handler may call, `on_hopeless` is called unless the block ends
    in time. A program that is halted in a debugger is left alone.
    """

    def __init__(self, kernel: Kernel, on_hopeless: Callable[[str], None] | None = None):
        self._kernel = kernel
        self._on_hopeless = on_hopeless
        self._watched, self._task = threading.get_ident(), threading.get_native_id()
        self._done = threading.Event()
        self._end: float | None = None
        self.breaks_handlers: bool = False

    def __enter__(self) -> "Watchdog":
        threading.Thread(target=self._watch, name="watchdog", daemon=True).start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        self._done.set()
        if self._on_hopeless is not None:
            faulthandler.cancel_dump_traceback_later()

    def set_stop_deadline(self, seconds: float, *, hasty: bool = False) -> None:
        """Expect the end within `seconds`; if `hasty`, handlers that do not return are broken at once."""
        now = time.monotonic()
        if self._end is None or now + seconds < self._end:
            self._end = now + seconds
        self.breaks_handlers = self.breaks_handlers or hasty
        if self._on_hopeless is not None:  # the last resort, should even this thread not run
            with contextlib.suppress(ValueError, OSError, RuntimeError):
                faulthandler.dump_traceback_later(seconds + PERIOD, exit=True, file=sys.__stderr__ or sys.stderr)

    def _watch(self) -> None:
        kernel, seen, last, armed = self._kernel, (-1, -1), time.monotonic(), 0.0
        stuck, reported, broken, calls, queued = 0.0, False, 0.0, -1, _queued_for_processor(self._task)
        while not self._done.wait(PERIOD):
            now, progress, ending = time.monotonic(), (kernel.events, kernel.now_ns), self._end
            passed, last = now - last, now
            if passed > HOPELESS_AFTER and armed:
                logger.warning(
                    "no thread ran for %.0f s: the process was halted, or a library held the interpreter's lock; "
                    "if threads are listed above, that is where they were",
                    passed,
                )
            before, queued = queued, _queued_for_processor(self._task)
            # Else a handler would seem stuck in a program that was halted, or on a computer that others keep busy.
            passed = max(0.0, min(passed, LONGEST_SLEEP) - (queued - before))
            if ending is not None and now > ending:
                self._give_up(f"it did not stop in time: {self._place(self._stack())}")
                return
            if self._on_hopeless is not None and ending is None and not kernel.virtual and now - armed > 1.0:
                armed = now
                self._expect_myself()
            if progress != seen:
                seen, stuck, reported, broken, calls = progress, 0.0, False, 0.0, -1
                continue
            stack = self._stack()
            call = next((frame for frame in stack if frame.f_code in CALLS), None)
            # A kernel adds the calls of a moment to its events only at the end of them.
            made = call.f_locals.get("busy", 0) if call is not None else calls
            if made != calls:
                stuck, reported, broken, calls = 0.0, False, 0.0, made
                continue
            if _in_debugger(stack) or (call is None and not kernel.virtual):  # it is halted, or it waits
                stuck = 0.0
                continue
            stuck += passed
            if call is None:
                if stuck > STANDSTILL and not reported:
                    reported = True
                    logger.error("the clock has not moved for %.0f s: %s", stuck, self._place(stack))
                continue
            if stuck > NAMED_AFTER and not reported:
                reported = True
                logger.error("%s: %s; no other task runs meanwhile", self._subject(call, stuck), self._place(stack))
            hasty = self.breaks_handlers and ending is not None and stuck > HASTE
            if (hasty or (stuck > BROKEN_AFTER and not kernel.virtual)) and now - broken > (HASTE if hasty else 1.0):
                broken = now
                _raise_in(self._watched, f"stopped after {stuck:.1f} s")
            if stuck > HOPELESS_AFTER and not kernel.virtual:
                self._give_up(f"{self._subject(call, stuck)} and cannot be interrupted: {self._place(stack)}")
                return

    def _expect_myself(self) -> None:
        """Let all threads' places be written if this thread does not run: a library may hold the interpreter's lock.

        A process that was halted for so long cannot be distinguished from that, so this takes long.
        """
        with contextlib.suppress(ValueError, OSError, RuntimeError):  # stderr is no file
            faulthandler.dump_traceback_later(HOPELESS_AFTER, file=sys.__stderr__ or sys.stderr)

    def _give_up(self, text: str) -> None:
        if not self._done.is_set() and self._on_hopeless is not None:
            self._on_hopeless(text)

    def _subject(self, call: FrameType, seconds: float) -> str:
        function, args = call.f_locals.get("function"), call.f_locals.get("args", ())
        if function is None:
            return f"a handler has not returned for {seconds:.1f} s"
        owner = args[0].owner if args and isinstance(args[0], Timer) else owner_of(function)
        return f"{owner_title(owner)} has not returned from {handler_name(function, args)} for {seconds:.1f} s"

    def _stack(self) -> list[FrameType]:
        """The frames of the watched thread, the innermost first."""
        frame = sys._current_frames().get(self._watched)  # pyright: ignore[reportPrivateUsage]
        found: list[FrameType] = []
        while frame is not None:
            found.append(frame)
            frame = frame.f_back
        return found

    def _place(self, stack: list[FrameType]) -> str:
        """The line that a thread is in and, if that is elsewhere, the line of the handler that led there."""
        calls = [number for number, frame in enumerate(stack) if frame.f_code in CALLS]
        inside = stack[: calls[0]] if calls else stack
        handler = next((f for f in reversed(inside) if not f.f_code.co_filename.startswith(RUNTIME)), None)
        inner = f"in {_line(stack[0])}" if stack else "nowhere"
        return inner if not calls or handler in (None, stack[0]) else f"{inner}, called from {_line(handler)}"


def _queued_for_processor(task: int) -> float:
    """Time (s) that a thread has been ready to run without a processor; 0 where the system does not count it."""
    try:
        return int(Path(f"/proc/self/task/{task}/schedstat").read_text().split()[1]) / 1e9
    except (OSError, IndexError, ValueError):
        return 0.0


def _line(frame: FrameType) -> str:
    path, number = frame.f_code.co_filename, frame.f_lineno
    code = linecache.getline(path, number).strip()
    return f"{path}:{number} ({code})" if code else f"{path}:{number}"


def _in_debugger(stack: list[FrameType]) -> bool:
    return any(f.f_trace is not None or f.f_globals.get("__name__") in DEBUGGERS for f in stack)


def _raise_in(thread: int, text: str) -> None:
    """Raise HandlerBlockedError in another thread as soon as it runs Python code."""

    class Now(HandlerBlockedError):
        def __init__(self) -> None:  # the thread makes the instance, without arguments
            super().__init__(text)

    ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), ctypes.py_object(Now))
