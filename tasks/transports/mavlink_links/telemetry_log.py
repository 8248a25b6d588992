"""Records the frames of MAVLink links as .tlog files, one for each flight, beside the log with which it begins."""

import os
from collections.abc import Callable
from pathlib import Path

import imc
from mavlink import Dialect, Flavor, ReceivedMessage, encode, split
from support.log_limit import Trouble

MIB = 1 << 20
MOST_WAITING = 8 * MIB  # bytes of a file that wait while the disk refuses them
FULL = 1 << 16  # bytes that are written without waiting for the next flush
SECRET = "SETUP_SIGNING"  # has the key
Op = imc.LoggingControl.Op


class TelemetryLogs:
    """One file for each flavor, since a station that reads both would see one vehicle change its kind all the time.

    A vehicle begins a log with each plan, and each order of a station is a plan: while it is armed or moves
    (`in_flight`), the recording stays in the folder where it is, so that one flight is one file.

    Frames that come before there is a log, or while the disk is full, wait in memory. Each is written without its
    signature. `report` receives what is wrong, once.
    """

    def __init__(
        self, dialect: Dialect, root: Path, report: Callable[[str], object], in_flight: Callable[[], bool]
    ) -> None:
        self._dialect = dialect
        self._root = root
        self._report = report
        self._in_flight = in_flight
        self._files: dict[str, _File] = {}
        self._folder: Path | None = None
        self._newest: Path | None = None  # folder of the present log
        self._stopped = False
        self._trouble = Trouble()

    def recording_transmit(
        self, flavor: Flavor, transmit: Callable[[bytes], object], now: Callable[[], float]
    ) -> Callable[[bytes], object]:
        """A `transmit` that also records what it sends."""

        def send(frame: bytes) -> object:
            if frame[2]:  # signed: the record must be a whole frame without that
                for message in split(frame, self._dialect)[0]:
                    self.record_received(flavor, message, now())
            else:
                self._add(flavor, frame, now())
            return transmit(frame)

        return send

    def record_received(self, flavor: Flavor, message: ReceivedMessage, now: float) -> None:
        """Record a received message."""
        if message.name != SECRET:
            parts = message.definition, message.payload, message.sequence, message.system, message.component
            self._add(flavor, encode(*parts), now)

    def on_logging_control(self, log: imc.LoggingControl) -> None:
        """Continue in the folder of the log that begins, or after the flight; without a log nothing is recorded."""
        if log.op == Op.STARTED:
            self._stopped = False
            folder = (self._root / log.name).resolve()
            if folder.is_relative_to(self._root.resolve()):
                self._newest = folder
                self._follow_log()
        elif log.op == Op.STOPPED:
            self._stopped = True

    def set_folder(self, folder: Path | None) -> None:
        """Write to the files of another folder from now on."""
        if self._folder not in (None, folder):
            self._write()
            for file in self._files.values():
                file.close()
        self._folder = self._newest = folder

    def flush(self) -> None:
        """Write what waits; rejected content is kept. After a flight, move to the folder of the present log."""
        self._write()
        self._follow_log()

    def _follow_log(self) -> None:
        if self._newest != self._folder and (
            self._folder is None or not self._in_flight() or any(file.is_removed for file in self._files.values())
        ):
            self.set_folder(self._newest)

    def _write(self) -> None:
        reason = ""
        for file in self._files.values():
            try:
                file.write(self._folder)
            except OSError as error:
                reason = f"{error.filename or file.name}: {error.strerror}"
        if reason:
            self._trouble.report(reason, self._report, f"MAVLink is not recorded: {reason}")
        elif self._trouble.end():
            lost = sum(file.lost for file in self._files.values())  # integers
            self._report(f"MAVLink is recorded again; {lost} frames were lost")

    def close(self) -> None:
        """Record nothing until the next log begins."""
        self.set_folder(None)
        self._stopped = True

    def _add(self, flavor: Flavor, frame: bytes, now: float) -> None:
        if self._stopped:
            return
        file = self._files.get(flavor.name)
        if file is None:
            name = f"Data-{flavor.name}.tlog" if self._files else "Data.tlog"
            file = self._files[flavor.name] = _File(name)
        if file.add(round(now * 1e6).to_bytes(8) + frame) and not self._trouble.reason:
            self._write()


class _File:
    """A file of all logs, and what waits for it; `lost` counts the frames for which there was no room."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.lost = 0
        self._waiting = bytearray()
        self._descriptor = -1

    @property
    def is_removed(self) -> bool:
        """Whether somebody has removed the file that is open."""
        return self._descriptor >= 0 and os.fstat(self._descriptor).st_nlink == 0

    def add(self, record: bytes) -> bool:
        """Add a time and a frame; returns whether it is worth a write."""
        if len(self._waiting) + len(record) > MOST_WAITING:
            self.lost += 1
        else:
            self._waiting += record
        return len(self._waiting) >= FULL

    def write(self, folder: Path | None) -> None:
        """Write what waits; what was written before an error is not written again. Raises OSError."""
        if folder is None or not self._waiting:
            return
        if self._descriptor < 0:
            self._descriptor = os.open(folder / self.name, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC, 0o644)
        while self._waiting:
            done = os.write(self._descriptor, self._waiting)
            del self._waiting[:done]

    def close(self) -> None:
        """Close it; content that the disk has rejected until now is dropped."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
        self._descriptor = -1
        self._waiting.clear()
