"""Starts processes, and starts those again that end, with a growing pause."""

import contextlib
import signal
import subprocess
import threading
import time
from collections import deque
from collections.abc import Iterable, Mapping, Sequence

LONGEST_PAUSE = 60.0  # s
HEALTHY_AFTER = 60.0  # s
ENDING = 3.0  # s from the request to end to its being killed
MOST_LINES = 20
LAST_WORDS = 1.0  # s to read what an ended process has said; its own children may keep the pipe open
FROM_OUTSIDE = {signal.Signals[name] for name in ("SIGKILL", "SIGTERM", "SIGINT") if name in signal.Signals.__members__}


class Child:
    """One process: its command, and how it goes. `failures` counts its ends in a row that nobody asked for.

    `last` is the last line of its standard error, `restarts` how often it was started again.
    """

    def __init__(self, name: str, command: Sequence[str], environment: Mapping[str, str] | None = None) -> None:
        self.name = name
        self.command = list(command)
        self.environment = environment
        self.failures = 0
        self.restarts = 0
        self.ended_well = False
        self.popen: subprocess.Popen[bytes] | None = None
        self._began = self._due = 0.0
        self._lines: deque[str] = deque(maxlen=MOST_LINES)
        self._reader: threading.Thread | None = None

    @property
    def runs(self) -> bool:
        return self.popen is not None and self.popen.poll() is None

    @property
    def last(self) -> str:
        return next((line for line in reversed(self._lines) if line), "")

    def start(self) -> None:
        """Raises OSError."""
        self._lines.clear()
        self._began = time.monotonic()
        quiet = subprocess.DEVNULL
        self.popen = subprocess.Popen(
            self.command, stdin=quiet, stdout=quiet, stderr=subprocess.PIPE, env=self.environment
        )
        name = f"errors of {self.name}"
        self._reader = threading.Thread(target=self._read, args=(self.popen,), name=name, daemon=True)
        self._reader.start()

    def look(self, restart: bool) -> str:
        """Start it if it does not run and is due; what has happened, "" if nothing."""
        now = time.monotonic()
        if self.popen is None:
            if now < self._due or self.ended_well:
                return ""
            self.start()
            self.restarts += self.failures > 0
            return "started again" if self.failures else "started"
        status = self.popen.poll()
        if status is None:
            return ""
        self.popen = None
        if self._reader is not None:
            self._reader.join(LAST_WORDS)
        if status == 0:
            self.ended_well = True
            return "has ended"
        self.failures = 1 if now - self._began > HEALTHY_AFTER else self.failures + 1
        pause = min(LONGEST_PAUSE, 2.0 ** min(self.failures - 1, 10))
        self._due = now + pause
        self.ended_well = not restart
        how = f"was killed by signal {-status}" if status < 0 else f"has ended with status {status}"
        why = f" ({self.last})" if self.last and -status not in FROM_OUTSIDE else ""
        return f"{how}{why}{f'; it starts again in {pause:g} s' if restart else ''}"

    def _read(self, popen: subprocess.Popen[bytes]) -> None:
        assert popen.stderr is not None
        with contextlib.suppress(OSError, ValueError):
            for line in popen.stderr:
                self._lines.append(line.decode(errors="replace").strip())


class Keeper:
    """Keeps processes running: call `look` often, and `stop` at the end.

    A process that ends with status 0 has done its work, and is not started again; others are, if `restart`.
    """

    def __init__(self, children: Iterable[Child], *, restart: bool = True) -> None:
        self.children = list(children)
        self._restart = restart

    @property
    def done(self) -> bool:
        return all(child.ended_well for child in self.children)

    def look(self) -> list[tuple[Child, str]]:
        """Start what is due; what has happened, in words."""
        events: list[tuple[Child, str]] = []
        for child in self.children:
            try:
                words = child.look(self._restart)
            except OSError as error:
                words, child.ended_well = f"cannot be started: {error}", True
            if words:
                events.append((child, words))
        return events

    def stop(self) -> None:
        """End all, together; what has not ended in ENDING seconds is killed."""
        running = [child.popen for child in self.children if child.popen is not None and child.runs]
        for popen in running:
            popen.terminate()
        deadline = time.monotonic() + ENDING
        for popen in running:
            try:
                popen.wait(max(0.0, deadline - time.monotonic()))
            except subprocess.TimeoutExpired:
                popen.kill()
                popen.wait()
        for child in self.children:
            child.popen, child.ended_well = None, True
