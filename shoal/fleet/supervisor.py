"""Starts processes, and starts those again that end, with a growing pause."""

import contextlib
import errno
import signal
import subprocess
import threading
import time
from collections import deque
from collections.abc import Iterable, Mapping, Sequence

from support.backoff import Backoff

LONGEST_PAUSE = 60.0  # s
HEALTHY_AFTER = 60.0  # s
ENDING = 3.0  # s from the request to end to its being killed
MOST_LINES = 20
LAST_WORDS = 1.0  # s to read the output of an ended process; its own children may keep the pipe open
FROM_OUTSIDE = {signal.Signals[name] for name in ("SIGKILL", "SIGTERM", "SIGINT") if name in signal.Signals.__members__}


class ManagedProcess:
    """One process: its command and its state. `failures` counts its unrequested ends in a row, and the starts that the
    system rejected.

    `last_error_line` is that of its standard error, `restarts` how often it was started again. It `ended_well` if its
    status was 0; it `is_over` if it is not to start again, for any reason.
    """

    def __init__(self, name: str, command: Sequence[str], environment: Mapping[str, str] | None = None) -> None:
        self.name = name
        self.command: list[str] = list(command)
        self.environment = environment
        self.starts: int = 0
        self.ended_well: bool = False
        self.is_over: bool = False
        self.popen: subprocess.Popen[bytes] | None = None
        self._due = 0.0
        self._backoff = Backoff(1.0, LONGEST_PAUSE, HEALTHY_AFTER)
        self._error_lines: deque[str] = deque(maxlen=MOST_LINES)
        self._reader: threading.Thread | None = None

    @property
    def is_running(self) -> bool:
        return self.popen is not None and self.popen.poll() is None

    @property
    def failures(self) -> int:
        """Number of failures since it last worked."""
        return self._backoff.failures

    @property
    def restarts(self) -> int:
        return max(0, self.starts - 1)

    @property
    def last_error_line(self) -> str:
        return next((line for line in reversed(self._error_lines) if line), "")

    def start(self) -> None:
        """Raises OSError."""
        self._error_lines.clear()
        quiet = subprocess.DEVNULL
        popen = subprocess.Popen(self.command, stdin=quiet, stdout=quiet, stderr=subprocess.PIPE, env=self.environment)
        name = f"errors of {self.name}"
        self._reader = threading.Thread(target=self._read, args=(popen,), name=name, daemon=True)
        try:
            self._reader.start()
        except RuntimeError as error:  # no more threads: its output would not be read, and would block it
            self._reader = None
            popen.kill()
            popen.wait()
            raise OSError(errno.EAGAIN, str(error)) from error
        self.popen = popen
        self.starts += 1

    def poll(self, restart: bool) -> str:
        """Start it if it does not run and is due; what has happened, "" if nothing."""
        now = time.monotonic()
        if self.popen is None:
            if self.is_over or now < self._due:
                return ""
            try:
                self.start()
            except OSError as error:
                return f"cannot be started: {error}{self._fail(now, restart)}"
            return "started again" if self.restarts else "started"
        status = self.popen.poll()
        if status is None:
            return ""
        self.popen = None
        if self._reader is not None:
            self._reader.join(LAST_WORDS)
        if status == 0:
            self._backoff.reset()
            self.ended_well = self.is_over = True
            return "has ended"
        how = f"was killed by signal {-status}" if status < 0 else f"has ended with status {status}"
        why = f" ({self.last_error_line})" if self.last_error_line and -status not in FROM_OUTSIDE else ""
        return f"{how}{why}{self._fail(now, restart)}"

    def _fail(self, now: float, restart: bool) -> str:
        """Count a failure; what follows from it, in words."""
        self.is_over = not restart
        pause = self._backoff.fail(now)
        self._due = now + pause
        return f"; it starts again in {pause:g} s" if restart else ""

    def _read(self, popen: subprocess.Popen[bytes]) -> None:
        assert popen.stderr is not None
        with contextlib.suppress(OSError, ValueError):
            for line in popen.stderr:
                self._error_lines.append(line.decode(errors="replace").strip())


class Supervisor:
    """Keeps processes running: call `poll` often, and `stop` at the end.

    A process that ends with status 0 has done its work, and is not started again; others are, if `restart`, and so are
    those that the system could not start.
    """

    def __init__(self, processes: Iterable[ManagedProcess], *, restart: bool = True) -> None:
        self.processes: list[ManagedProcess] = list(processes)
        self._restart = restart

    @property
    def is_over(self) -> bool:
        """Whether none is to start again, however it has ended."""
        return all(process.is_over for process in self.processes)

    @property
    def never_started(self) -> list[ManagedProcess]:
        """Processes that the system has never been able to start."""
        return [process for process in self.processes if process.failures and not process.starts]

    def poll(self) -> list[tuple[ManagedProcess, str]]:
        """Start what is due; what has happened, in words."""
        events: list[tuple[ManagedProcess, str]] = []
        for process in self.processes:
            if words := process.poll(self._restart):
                events.append((process, words))
        return events

    def stop(self) -> None:
        """End all, together; what has not ended in ENDING seconds is killed."""
        running = [process.popen for process in self.processes if process.popen is not None and process.is_running]
        for popen in running:
            popen.terminate()
        deadline = time.monotonic() + ENDING
        for popen in running:
            try:
                popen.wait(max(0.0, deadline - time.monotonic()))
            except subprocess.TimeoutExpired:
                popen.kill()
                popen.wait()
        for process in self.processes:
            process.popen, process.is_over = None, True
