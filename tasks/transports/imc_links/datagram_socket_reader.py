"""Reads the datagrams of a task's sockets: many at a time, but never so many that the other tasks wait."""

import socket
import struct
from collections.abc import Callable, Sequence

from runtime import Task
from tasks.transports.imc_links.recvmmsg import AT_ONCE, Datagram, make_datagram_reader
from tasks.transports.imc_links.sockets import schedule_network_timer

ROUNDS = 4  # of AT_ONCE datagrams, with handlers and timers between them
PAUSE = 0.002  # s, after so many rounds, for the other tasks
SO_MEMINFO, MEMINFO = 55, struct.Struct("9I")  # of Linux; the last number counts what found no room in the buffer


class DatagramReader:
    """Calls `take` with the datagrams that arrive at the sockets, until it is closed.

    If a socket has none to read, `failed` is called: a packet from there was rejected.
    """

    def __init__(
        self,
        task: Task,
        sockets: Sequence[socket.socket],
        take: Callable[[list[Datagram]], object],
        failed: Callable[[], object] = lambda: None,
    ):
        self._task = task
        self._take, self._failed = take, failed
        self._datagrams = make_datagram_reader()
        self._full = dict.fromkeys(sockets, 0)  # readings in a row that found as many as they could
        self._readings = {each: lambda each=each: self._read(each) for each in sockets}
        for each, reading in self._readings.items():
            task.watch(each, reading)

    @property
    def missed(self) -> int:
        """The number of datagrams that came too fast to be read; known on Linux only."""
        count = 0
        for each in self._readings:
            try:
                count += MEMINFO.unpack(each.getsockopt(socket.SOL_SOCKET, SO_MEMINFO, MEMINFO.size))[-1]
            except (OSError, struct.error):
                continue
        return count

    def close(self) -> None:
        """Close the sockets."""
        readings, self._readings = self._readings, {}
        for each in readings:
            self._task.unwatch(each)
            each.close()

    def _read(self, readable: socket.socket) -> None:
        try:
            datagrams = self._datagrams(readable)
        except OSError:
            datagrams = []
        if not datagrams:
            self._failed()
            return
        self._take(datagrams)
        self._full[readable] = full = self._full[readable] + 1 if len(datagrams) == AT_ONCE else 0
        if full >= ROUNDS and readable in self._readings:
            self._full[readable] = 0
            self._task.unwatch(readable)
            schedule_network_timer(self._task, PAUSE, self._resume_reading, readable)

    def _resume_reading(self, readable: socket.socket) -> None:
        if readable in self._readings:
            self._task.watch(readable, self._readings[readable])
