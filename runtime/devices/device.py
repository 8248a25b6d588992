"""A device of a task: opened again whenever it goes away, read without waiting, and never more than can be handled."""

import struct
import time
from collections.abc import Callable
from typing import Any, Protocol

from runtime.devices.connections import Address, Connection, Datagram, UdpConnection, resolve_host, without_errno
from runtime.devices.framing import Splitter
from runtime.devices.scripted_input import TimedData
from runtime.kernel import SECOND, Readable
from support.backoff import Backoff
from support.log_limit import ReportLimit, Trouble

FIRST_RETRY, LAST_RETRY = 0.5, 5.0  # s
CONNECT_TIMEOUT, CONNECT_PERIOD = 5.0, 0.05  # s
SILENCE = 2.0  # s without a byte, after which the rest of a piece is not expected any more
MOST_PIECES = 2000  # lines or frames per second, since each may cause messages
MOST_WORK = SECOND // 5  # of the processor's time per second
MOST_WAITING = 1 << 16  # bytes that wait to be sent
FLUSH_PERIOD = 0.02  # s
LOG_PERIOD = 30 * SECOND  # between two equal entries in the log book: a cable may be loose
SHOWN = 60  # characters of a piece in the log book
NOT_UNDERSTOOD = (ValueError, LookupError, struct.error)
"""Errors that a handler raises for a malformed piece: `float("1x")`, `fields[7]`."""


class DeviceLog(Protocol):
    """The log book in which a device reports to operators."""

    def info(self, text: str) -> None: ...
    def warning(self, text: str) -> None: ...
    def error(self, text: str) -> None: ...


class DeviceOwner(Protocol):
    """The part of a task that its device needs."""

    @property
    def log(self) -> DeviceLog: ...
    @property
    def now_ns(self) -> int: ...
    def after(self, seconds: float, function: Callable[..., object], *args: Any) -> Any: ...
    def watch(self, source: Readable, function: Callable[[], object]) -> None: ...
    def unwatch(self, source: Readable) -> None: ...
    def offload(
        self, function: Callable[..., Any], *args: Any, then: Callable[[Any], object], latency: float = 0.0
    ) -> None: ...


class Device:
    """A serial port or socket that a task has opened: `write` sends, and pieces of what arrives go to a handler.

    `good` counts the pieces that the handler took, `bad` those that are damaged, or that it did not understand: it
    raised ValueError, LookupError or struct.error. `skipped_bytes` belong to no piece. While the device is missing,
    `trouble` has been called with the reason, and opening it is tried again, at least every 5 s; "" ends the trouble.
    If `trouble` closes the device, the reason is not logged. `log` is where it reports
    instead of its owner's log book. A driver may set `explain`, which returns what came in the last seconds instead
    of the expected data; empty if unknown.
    """

    explain: Callable[[float], str]

    def __init__(
        self,
        owner: DeviceOwner,
        address: Address,
        splitter: Splitter,
        handler: Callable[[bytes], object],
        *,
        opened: Callable[[], object] | None = None,
        trouble: Callable[[str], object] = lambda _: None,
        log: DeviceLog | None = None,
    ):
        self.name: str = address.name
        self.good: int = 0
        self.bad: int = 0
        self.explain = lambda _: ""
        self._owner = owner
        self._log = log or owner.log
        self._address = address
        self._splitter = splitter
        self._handler = handler
        self._opened = opened
        self._trouble = trouble
        self._connection: Connection | None = None
        self._send: Callable[[bytes], object] | None = None  # instead of a connection
        self._outgoing = bytearray()
        self._flushing = self._closed = self._paused = self._connecting = False
        self._backoff = Backoff(FIRST_RETRY, LAST_RETRY)
        self._failure = Trouble()
        self._logged = ReportLimit(LOG_PERIOD)
        self._received_at = 0
        self._second, self._pieces, self._bytes, self._work = 0, 0, 0, 0
        self._unheeded = 0  # bytes since the last good piece

    @property
    def skipped_bytes(self) -> int:
        return self._splitter.skipped_bytes

    @property
    def is_open(self) -> bool:
        return (self._connection is not None and not self._connecting) or self._send is not None

    @property
    def unsent_bytes(self) -> int:
        """Bytes that `write` has accepted and the device has not."""
        return len(self._outgoing)

    def open(self) -> None:
        """Try to open it as soon as the present handler ends, and again until it succeeds."""
        self._owner.after(0.0, self._try)

    def play_recording(self, pieces: list[TimedData], send: Callable[[bytes], object]) -> None:
        """Receive a recording in the place of the device."""
        self._owner.after(0.0, self._begin_to_play, send)
        for piece in pieces:
            self._owner.after(piece.time / SECOND, self._play, piece.data, send)

    def no_data_message(self, seconds: float) -> str:
        """The report if nothing that is understood has come for this time."""
        if known := self.explain(seconds):
            return f"{self.name}: {known}"
        if not self._unheeded:
            return f"{self.name}: no data for {seconds:g} s"
        hint = "; is the baud rate right?" if self._address.starts_midway and not self._address.unresolved_host else ""
        return f"{self.name}: nothing valid for {seconds:g} s, in {self._unheeded} bytes{hint}"

    def write(self, data: bytes) -> bool:
        """Send bytes, in order, without waiting; False if the device is not open, or they wait already."""
        if self._send is not None:
            self._send(data)
            return True
        if self._connection is None or self._connecting:
            return False
        if self._address.datagrams:
            self._write_now(data)
            return True
        if len(self._outgoing) + len(data) > MOST_WAITING:
            return False
        self._outgoing += data
        if not self._flushing:
            self._flush()
        return True

    def set_destination(self, piece: bytes) -> None:
        """Let `write` send to the sender of this datagram, when several send to one port; else no effect."""
        if isinstance(self._connection, UdpConnection) and isinstance(piece, Datagram) and piece.source is not None:
            self._connection.set_destination(piece.source)

    def close(self) -> None:
        """Close it for good."""
        self._closed = True
        self._drop()
        self._send = None

    def receive_data(self, data: bytes) -> None:
        """Take bytes that have arrived."""
        now = self._owner.now_ns
        if self._address.datagrams:
            self._splitter.reset(midway=False)
        elif self._splitter.unfinished_bytes and now - self._received_at > SILENCE * SECOND:
            self._splitter.reset(midway=True)  # the rest of that piece was lost
        self._received_at = now
        self._backoff.reset()
        if self._failure.end():
            self._log.info(f"{self.name} sends again")
        if now - self._second >= SECOND:
            self._second, self._pieces, self._bytes, self._work = now, 0, 0, 0
        self._bytes += len(data)
        self._unheeded += len(data)
        damaged = self._splitter.damaged
        pieces = self._splitter.feed(data)
        for _ in range(min(self._splitter.damaged - damaged, len(data))):
            self._count_bad("damaged")
        for piece in pieces:
            self._pieces += 1
            try:
                self._handler(piece)
            except NOT_UNDERSTOOD as error:
                shown = repr(piece[:SHOWN])[1:] + ("..." if len(piece) > SHOWN else "")
                self._count_bad(f"not understood: {shown}: {error}")
            else:
                self.good, self._unheeded = self.good + 1, 0
            if self._closed:
                return

    def close_and_retry(self, error: OSError) -> None:
        """The device has gone: close it, and try to open it again later."""
        self._drop()
        self._report(without_errno(error))
        if not self._closed:
            self._owner.after(self._backoff.fail(), self._try)

    def _try(self) -> None:
        if self._closed or self._connection is not None:
            return
        if self._address.unresolved_host:
            self._owner.offload(resolve_host, self._address.unresolved_host, then=self._open_at)
        else:
            self._open_at("")

    def _open_at(self, address: str | OSError) -> None:
        if self._closed or self._connection is not None:
            return
        try:
            if isinstance(address, OSError):
                raise address
            self._connection = self._address.open(address)
        except OSError as error:
            self.close_and_retry(error)
            return
        self._connecting = True
        self._await(self._owner.now_ns + round(CONNECT_TIMEOUT * SECOND), self._connection)

    def _await(self, until: int, connection: Connection) -> None:
        """Wait until it is connected: the kernel wakes only for what can be read."""
        if connection is not self._connection:
            return
        try:
            if not connection.is_connected():
                if self._owner.now_ns >= until:
                    raise OSError("no answer")
                self._owner.after(CONNECT_PERIOD, self._await, until, connection)
                return
        except OSError as error:
            self.close_and_retry(error)
            return
        self._connecting = False
        self._splitter.reset(midway=self._address.starts_midway)
        self._owner.watch(connection, self._read)
        self._report_open()

    def _report_open(self) -> None:
        self._trouble("")
        if self._opened is not None:
            self._opened()

    def _read(self) -> None:
        connection = self._connection
        if connection is None:
            return
        try:
            portions = connection.read()
        except OSError as error:
            self.close_and_retry(error)
            return
        began = time.thread_time_ns()
        for data in portions:
            self.receive_data(data)
        self._work += time.thread_time_ns() - began
        self._rest()

    def _rest(self) -> None:
        """Leave it for the rest of the second if it sends too much; what does not fit waits, or is lost, outside."""
        few = self._pieces <= MOST_PIECES and self._bytes <= self._address.max_read_rate and self._work <= MOST_WORK
        if few or self._connection is None:
            return
        self._owner.unwatch(self._connection)
        self._owner.after(max(0.0, (self._second - self._owner.now_ns) / SECOND + 1.0), self._resume, self._connection)
        if not self._paused:
            self._paused = True
            count = f"{self._pieces} pieces, {self._bytes / 1024.0:.0f} KiB"
            self._log.warning(f"{self.name} sends more than can be handled ({count} in a second): the rest waits")

    def _resume(self, connection: Connection) -> None:
        if connection is self._connection:
            self._owner.watch(connection, self._read)

    def _count_bad(self, what: str) -> None:
        self.bad += 1
        if str(self.bad).strip("0") == "1":  # 1, 10, 100 ...
            self._log.warning(f"{self.name}: " + (f"{self.bad} bad, the last " if self.bad > 1 else "") + what)

    def _report(self, text: str) -> None:
        named = f"{self.name}: {text}"
        self._trouble(named)
        if self._closed:
            return
        if text != self._failure.reason and self._logged.is_due(text, self._owner.now_ns):
            self._failure.report(text, self._log.error, named)

    def _drop(self) -> None:
        connection, self._connection = self._connection, None
        self._connecting = False
        self._outgoing.clear()
        if connection is not None:
            self._owner.unwatch(connection)
            connection.close()

    def _flush(self) -> None:
        self._flushing = False
        del self._outgoing[: self._write_now(bytes(self._outgoing))]
        if self._outgoing:
            self._flushing = True
            self._owner.after(FLUSH_PERIOD, self._flush)

    def _write_now(self, data: bytes) -> int:
        if self._connection is None:
            return 0
        try:
            return self._connection.write(data)
        except OSError as error:
            self.close_and_retry(error)
            return 0

    def _begin_to_play(self, send: Callable[[bytes], object]) -> None:
        self._send = send
        self._splitter.reset(midway=False)
        self._report_open()

    def _play(self, data: bytes | None, send: Callable[[bytes], object]) -> None:
        if self._closed:
            return
        if data is None:
            self._send = None
            self._report("unplugged")
            return
        if self._send is None:
            self._begin_to_play(send)
        self.receive_data(data)
