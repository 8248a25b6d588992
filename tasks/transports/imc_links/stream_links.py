"""IMC over connections: packets in and out of each, with bounds on what a peer can cost."""

import errno
import math
import socket
from collections import OrderedDict
from collections.abc import Callable
from contextlib import suppress
from functools import partial

import imc
from imc.console_acl import NOT_LISTED, REPORTS
from runtime import param, periodic
from runtime.kernel import Timer
from support.duplicate_filter import DuplicateFilter
from support.text_length import list_first
from support.token_bucket import TokenBucket
from tasks.transports.imc_links.datagram_filter import SPOOFED
from tasks.transports.imc_links.large_answers import LargeAnswers
from tasks.transports.imc_links.link_task import ImcLinkTask
from tasks.transports.imc_links.own_announce import is_for_log
from tasks.transports.imc_links.peer_table import MALFORMED, ON_THE_BUS, DropCounts
from tasks.transports.imc_links.sockets import network_silence, network_time, schedule_network_timer

READ_SIZE = 4096  # bytes taken from a connection at a time
LONGEST_WAIT = 1 << 20  # bytes that a peer leaves unread before it is cut off
LONGEST_RUBBISH = 1 << 17  # bytes that are no packets, in a row, before a peer is cut off
RUBBISH = 8  # bytes that cost as much as a packet
LONGEST_UNFINISHED = 1.0  # s that a packet may need before one behind it counts more
RETRY = 0.02  # s until what found no room is sent again
MOST_SYSTEMS = 64  # whose packets came by one connection, and are not sent back
QUIET = (
    3.0  # s without a packet of a system after which it may no longer read its connection; Heartbeat comes every 1 s
)
FULL = 1 << 16  # bytes that wait for a peer that reads too slowly
REPEATS = 1024  # forwarded packets that are remembered
ALIVE = {"TCP_KEEPIDLE": 15, "TCP_KEEPINTVL": 5, "TCP_KEEPCNT": 3, "TCP_USER_TIMEOUT": 30_000}  # s, s, probes, ms


class PacketStream:
    """One connection: a peer at `address`, called `name` in the log book, which may send `rate` packets per second."""

    def __init__(self, opened: socket.socket, address: str, name: str, now: float, rate: float):
        self.socket: socket.socket = opened
        self.address: str = address
        self.name: str = name
        self.parser: imc.StreamParser = imc.StreamParser()
        self.waiting: bytearray = bytearray()
        self.systems: OrderedDict[int, float] = OrderedDict()  # and when a packet of each came last (s)
        self.taken: int = 0
        self.commands: bool = False
        self.received_at = now  # when it connected, or sent a packet last
        self.bucket: TokenBucket = TokenBucket(rate, rate)
        self.bucket.spend(now, rate)  # who connects again and again gets no burst each time
        self.rubbish = self.lost = 0  # bytes outside packets: since the last good one, and reported in all
        self.greeted = False  # whether it was sent the last states, and so is sent all that follows
        self.awaited = False  # whether a timer will look behind an unfinished packet
        self.deaf: OSError | None = None  # why the peer takes nothing more
        opened.setblocking(False)
        opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        for name, value in ALIVE.items():  # a peer that has vanished is noticed within half a minute
            if (option := getattr(socket, name, None)) is not None:
                opened.setsockopt(socket.IPPROTO_TCP, option, value)

    def read(self) -> list[bytes] | None:
        """The packets that have arrived; None at the end of the stream. Raises OSError."""
        try:
            data = self.socket.recv(READ_SIZE)
        except BlockingIOError:
            return []
        return self.parser.feed_packets(data) if data else None

    def flush(self) -> bool:
        """Send what waits, as far as there is room; whether nothing is left.

        A peer that takes nothing more is deaf. What it has sent before can still be read, and then the end: imcjava
        connects, sends one command and closes.
        """
        try:
            while self.waiting:
                del self.waiting[: self.socket.send(self.waiting)]
        except BlockingIOError:
            return False
        except OSError as error:
            self.deaf = error
            self.waiting.clear()
            with suppress(OSError):  # a peer that lives nevertheless then ends the connection
                self.socket.shutdown(socket.SHUT_WR)
        return True

    def add_system(self, system: int, now: float) -> None:
        """Note that a packet of a system came by this connection."""
        self.systems[system] = now
        self.systems.move_to_end(system)
        if len(self.systems) > MOST_SYSTEMS:
            self.systems.popitem(last=False)

    def serves(self, system: int, silence: Callable[[float], float]) -> bool:
        """Whether a system lives at the other end, and reads what is sent; `silence` is that since a time (s)."""
        is_open = self.greeted and self.deaf is None and len(self.waiting) < FULL
        return is_open and silence(self.systems.get(system, -math.inf)) <= QUIET


class StreamLinkTask(ImcLinkTask):
    """Exchanges packets by connections; a subclass makes them, and calls `add_stream` with each."""

    maximum_rate: float = param(
        2000.0, "Hz", "Most packets per second that are taken from a connection.", minimum=10, editable=False
    )

    def start(self) -> None:
        self.streams = []
        self.drops: DropCounts = DropCounts()
        self.taken: int = 0
        self.forwarded: DuplicateFilter = DuplicateFilter(REPEATS)
        self.flushing: Timer | None = None
        super().start()

    def stop(self) -> None:
        for stream in self.streams:
            self.unwatch(stream.socket)
            stream.socket.close()
        self.streams = []

    def configure_peers(self) -> None:
        self.sent_ids: frozenset[int] = frozenset(kind.ID for kind in self.messages.types)
        self.streams: list[PacketStream] = getattr(self, "streams", [])  # other links may ask before this task starts

    def refresh_subscriptions(self) -> None:
        self.set_subscriptions_enabled(bool(self.streams))

    def add_stream(self, stream: PacketStream) -> None:
        self.streams.append(stream)
        self.watch(stream.socket, lambda: self.receive(stream))
        self.refresh_subscriptions()

    def greet(self, stream: PacketStream) -> None:
        """Send the last states, and from now on all that is listed."""
        if stream in self.streams and not stream.greeted:
            stream.greeted = True
            stream.waiting += b"".join(self.last_states(self.messages))
            self.flush_soon()

    def close_stream(self, stream: PacketStream, why: str, *, warn: bool = True) -> None:
        """End a connection, and report the reason."""
        if stream not in self.streams:
            return
        self.streams.remove(stream)
        self.unwatch(stream.socket)
        stream.socket.close()
        self.refresh_subscriptions()
        if warn:
            self.log.warning(f"connection with {stream.name} ended: {why}")
        self.on_closed(stream, why)

    def on_message(self, stream: PacketStream, message: imc.Message) -> None:
        """Called with each message of a connection that was put on the bus."""

    def withholds(self, stream: PacketStream) -> bool:
        """Whether nothing is sent by a connection."""
        return False

    def on_closed(self, stream: PacketStream, why: str) -> None:
        """Called when a connection has ended."""

    def serves(self, system: int, address: str) -> bool:
        """Whether a system at an address gets the messages of this vehicle that are listed by a connection.

        The address keeps a stranger elsewhere that uses the id of a console from ending what the console gets.
        """
        silence = partial(network_silence, self)
        return any(
            stream.address == address and stream.serves(system, silence) and not self.withholds(stream)
            for stream in self.streams
        )

    def receive(self, stream: PacketStream) -> None:
        """Take what has arrived; a peer that sends too much has to wait."""
        try:
            packets = stream.read()
        except OSError as error:
            self.close_stream(stream, error.strerror or str(error), warn=stream.taken > 0)
            return
        ended = packets is None
        for packet in stream.parser.close_packets() if packets is None else packets:
            self.publish_packet(stream, packet)
        rubbish = self.count_rubbish(stream)
        stream.rubbish = rubbish + (0 if packets else stream.rubbish)
        self.check_unfinished(stream)
        if ended and stream.deaf is not None and stream.deaf.errno != errno.EPIPE:
            self.close_stream(stream, stream.deaf.strerror or str(stream.deaf), warn=stream.taken > 0)
        elif ended:
            self.close_stream(stream, "the peer has closed it", warn=False)
        elif stream.rubbish > LONGEST_RUBBISH:
            self.close_stream(stream, "it sends no IMC")
        else:
            pause = stream.bucket.spend(network_time(self), len(packets or ()) + rubbish / RUBBISH)
            if pause and stream in self.streams:
                self.unwatch(stream.socket)
                schedule_network_timer(self, pause, self.resume, stream)

    def count_rubbish(self, stream: PacketStream) -> int:
        """The number of bytes that were no packets since the last time; the first ones of a peer are named."""
        rubbish = stream.parser.lost - stream.lost
        stream.lost += rubbish
        if rubbish and self.drops.add(MALFORMED, stream.address):
            reason = stream.parser.losses[-1].reason
            self.log.warning(
                f"{stream.name} has sent bytes that are no packet: {reason}; further ones are only counted"
            )
        return rubbish

    def check_unfinished(self, stream: PacketStream) -> None:
        """Look behind a packet that stays unfinished: a damaged length must not hide an Abort."""
        if not stream.awaited and (start := stream.parser.incomplete_offset) is not None:
            stream.awaited = True
            schedule_network_timer(self, LONGEST_UNFINISHED, self.resync, stream, start)

    def resync(self, stream: PacketStream, start: int) -> None:
        stream.awaited = False
        if stream not in self.streams:
            return
        if stream.parser.incomplete_offset == start:
            for packet in stream.parser.resync_packets():
                self.publish_packet(stream, packet)
            self.count_rubbish(stream)
        self.check_unfinished(stream)

    def resume(self, stream: PacketStream) -> None:
        """Read again from a peer that had to wait."""
        if stream in self.streams:
            self.watch(stream.socket, lambda: self.receive(stream))

    def publish_packet(self, stream: PacketStream, packet: bytes) -> None:
        """Put a packet on the bus, if it may come from there."""
        head = imc.header(packet)
        kind = imc.packet_id(packet)
        if self.vehicle.bus.is_system_on_transport(head.src):
            self.drops.add(ON_THE_BUS, f"0x{head.src:04X} at {stream.address}")
            return
        reason = SPOOFED if head.src == self.system else ""
        reason = reason or ("" if self.commanders.allows(head.src, stream.address, kind) else NOT_LISTED)
        if reason:
            if self.drops.add(reason, who := f"0x{head.src:04X} at {stream.address}"):
                self.log.warning(f"packet from {who} dropped: {reason}")
            if reason is NOT_LISTED and (answer := self.refusals.answer(packet, self.now)):
                stream.waiting += answer
                self.flush_soon()
            return
        try:
            message = self.relay(packet)
        except imc.DecodeError as error:
            if self.drops.add(MALFORMED, stream.address):
                self.log.warning(f"packet from {stream.name} dropped: {error.reason}")
            return
        self.taken += 1
        stream.taken += 1
        stream.received_at, stream.commands = network_time(self), stream.commands or kind not in REPORTS
        stream.add_system(head.src, stream.received_at)
        if isinstance(message, imc.ImageTxSettings):
            self.large_answers.on_request(message, stream.received_at, stream.address)
        self.on_message(stream, message)
        if not self.local_messages_only:
            self.transmit(message, packet)

    def transmit(self, message: imc.Message, packet: bytes) -> None:
        if isinstance(message, imc.Announce) and message.src == self.system and is_for_log(message):
            return
        if not self.streams or not self.messages.passes(message, network_time(self)):
            return
        if message.src != self.system and self.forwarded.is_duplicate(packet):
            return  # two that forward would never end
        receivers = None
        if message.ID in LargeAnswers.ids:
            receivers = self.large_answers.receivers(message, network_time(self))
        for stream in self.streams.copy():
            if receivers is not None and stream.systems.keys().isdisjoint(receivers):
                continue
            if not stream.greeted or stream.deaf is not None or message.src in stream.systems or self.withholds(stream):
                continue
            stream.waiting += packet
            if len(stream.waiting) > LONGEST_WAIT:
                self.drops.add("connections ended, since they were not read", stream.address)
                self.close_stream(stream, f"it leaves {LONGEST_WAIT >> 20} MiB unread")
        self.flush_soon()

    def flush_soon(self) -> None:
        if self.flushing is None:
            self.flushing = self.after(0.0, self.flush)

    def flush(self) -> None:
        """Send what waits; where there is no room, again a little later."""
        self.flushing = None
        emptied = True
        for stream in self.streams.copy():
            emptied &= stream.flush()
        if not emptied:
            self.flushing = schedule_network_timer(self, RETRY, self.flush)

    @periodic(1.0)
    def refresh_report(self) -> None:
        self.drops.merge_inactive(network_time(self))
        self.report()

    def report(self) -> None:
        """Set the state of the entity; called once a second."""

    def statistics_text(self) -> str:
        """The counts of taken and dropped packets, for the entity's state."""
        named = list_first([stream.name for stream in self.streams], 4)
        connected = f"{len(self.streams)} connected" + (f" ({named})" if named else "")
        return "; ".join(filter(None, (connected, f"{self.taken} packets taken", str(self.drops))))
