"""A bus on which re-run tasks receive the logged messages of all others, in the order of the log."""

from collections.abc import Callable

import imc
from runtime.bus import Bus
from runtime.kernel import Kernel
from runtime.task import SYSTEM_ENTITY
from shoal.rerun.logged_packet_times import LoggedPacket, LogReplay


class LoggedBus(Bus):
    """Delivers the log's messages at their times, those of one moment in the order of the log.

    A message that a task publishes here follows the messages that precede it in the log. The tasks' own messages in
    the log are not delivered. What is published here for others (the Daemon's heartbeat) is dropped: the log has it.
    `on_logged` is called with the tasks' packets in the log, `on_published` with those that they publish here,
    `on_packet` with all that pass the bus. After the end of a log that is `cut_short`, `on_published` is not called:
    they have no counterpart.
    """

    cut_short = False
    needs_packets = True

    history: LogReplay
    schema: imc.Schema
    daemon: object
    on_logged: Callable[[imc.Header, bytes], object]
    on_published: Callable[[imc.Header, bytes], object]
    on_packet: Callable[[bytes], object]

    def __init__(self, kernel: Kernel, system: int):
        super().__init__(kernel, system)
        self.malformed_in_log: int = 0
        self._names = dict[int, type | None]()

    def deliver_log(self, history: LogReplay, schema: imc.Schema, speakers: Callable[[imc.Header], bool]) -> None:
        """Start to deliver the log; `speakers` finds the tasks' own packets."""
        self.history, self.schema, self._is_own = history, schema, speakers
        self.kernel.soon(self._feed)

    def deliver_and_send(self, message: imc.Message, packet: bytes, origin: object) -> None:
        header = imc.header(packet)
        if not self._is_own(header):
            return
        over = self.cut_short and self.history.peek() is None
        for entry in self.history.pop_until_own_packet((header.id, header.src_ent), self.kernel.now_ns):
            self._pass(entry)
        if not over:
            self.on_published(header, packet)
        self.on_packet(packet)
        super().deliver_and_send(message, packet, origin)

    def finish(self) -> None:
        """Pass the rest of the log."""
        while self.history.peek() is not None:
            self._pass(self.history.pop())

    def _feed(self) -> None:
        """Deliver what is due up to the next message that a task should publish, and wait for that one."""
        now = self.kernel.now_ns
        while (entry := self.history.peek()) is not None and entry.time <= now and not entry.own:
            self._pass(self.history.pop())
        if entry is None:
            return
        if entry.time > now:
            self.kernel.at(entry.time, self._arrive)
            return
        if self.kernel.is_idle:  # nothing else is due that could publish it: only the log has it
            self._pass(self.history.pop())
        self.kernel.soon(self._feed)

    def _arrive(self) -> None:
        # Ticks of this moment are queued behind this call; in the logged run they came first.
        self.kernel.soon(self._feed)

    def _pass(self, entry: LoggedPacket) -> None:
        if entry.own:
            self.on_logged(entry.header, entry.packet)
            return
        self.on_packet(entry.packet)
        kind = self._kind(entry.header.id)
        if kind is not None and not self._route(kind):
            return
        try:
            message = self.schema.decode(entry.packet)
        except imc.DecodeError:
            self.malformed_in_log += 1
            return
        of_daemon = entry.header.src == self.system and entry.header.src_ent == SYSTEM_ENTITY
        self._deliver(message, entry.packet, self.daemon if of_daemon else None)

    def _kind(self, number: int) -> type | None:
        """The class of a message id; None if only decoding shows it."""
        if number not in self._names:
            try:
                self._names[number] = self.schema.by_id(number)
            except KeyError:
                self._names[number] = None
        return self._names[number]
