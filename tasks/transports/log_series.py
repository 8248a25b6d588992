"""The logs of one run on disk, one after the other."""

from collections.abc import Callable, Mapping
from pathlib import Path

from tasks.transports.log_folder import LogFolder, LogRemovedError


class LogSeries:
    """The log that is being written (`current`), and those that have ended while the disk rejected them.

    They reach the disk in order, so that each contains the first log of the run. `synchronize` is called with
    each log that was handed to the operating system.
    """

    def __init__(self, root: Path, synchronize: Callable[[LogFolder], object]):
        self.current: LogFolder | None = None
        self.waiting_logs: list[LogFolder] = []
        self._root = root
        self._synchronize = synchronize
        self._first, self._number = "", 0

    @property
    def unwritten_bytes(self) -> int:
        """Bytes that the disk has not accepted yet."""
        logs = [*self.waiting_logs, self.current] if self.current is not None else self.waiting_logs
        return sum(log.unwritten_bytes for log in logs)  # integers

    def begin(self, name: str, compression: str, files: Mapping[str, bytes]) -> LogFolder:
        """Begin a log, in memory until `flush`."""
        self._number += 1
        self.current = LogFolder(self._root, name, self._number, compression, files)
        return self.current

    def end(self) -> None:
        """End the current log."""
        if self.current is not None:
            self.waiting_logs.append(self.current)
            self.current = None

    def flush(self) -> None:
        """Write what waits, the oldest log first. Raises OSError; LogRemovedError if somebody removed a log."""
        while self.waiting_logs:
            try:
                self._write(self.waiting_logs[0])
            except LogRemovedError:
                self.waiting_logs.pop(0).close_without_flush()
                raise
            self.waiting_logs.pop(0).close_without_flush()
        if self.current is not None:
            self._write(self.current)

    def move_unwritten(self, removed: LogFolder, log: LogFolder) -> None:
        """Write to `log` what was not yet written to a log that somebody removed."""
        removed.close_without_flush()
        log.data.adopt_pending(removed.data)
        log.text.adopt_pending(removed.text)

    def close_without_flush(self) -> None:
        """Give up what the disk does not accept."""
        for log in self.waiting_logs:
            log.close_without_flush()

    def _write(self, log: LogFolder) -> None:
        if not log.made:
            log.make(self._first)
            self._first = self._first or log.name
        log.flush()
        self._synchronize(log)
