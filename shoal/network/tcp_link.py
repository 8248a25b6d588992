"""Systems that serve IMC over TCP, at places that are known."""

import asyncio
import time
from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass, field

import imc
from imc.discovery import PERIOD, Endpoint, displayable_name
from imc.layout import LARGEST_PACKET
from runtime.network_interfaces import is_loopback_host
from shoal.network.link import EVERYBODY, FAR, NEAR, ConsoleIdentity, LinkListener, ReceivedPacket

USUAL_PORT = 7001
FIRST_TRY = 0.5  # s that the first connections may take
PATIENCE = 5.0  # s for a connection
RETRY = 1.0  # s
BEAT = 1.0  # s
SILENCE = 5.0  # s after which a system, whose Heartbeat comes at 1 Hz, is gone
NAMELESS = 0.6  # s until a system that does not announce itself is called by its id
CLOSED = "has closed the connection"
LONGEST_UNFINISHED = 1.0  # s that a packet may need before one behind it counts more
MOST_SYSTEMS = 64  # of one connection
MOST_WAITING = 1 << 20  # bytes that the other side leaves unread


@dataclass(eq=False)
class _Connection:
    """A connection: the systems behind it by id, and why there is none."""

    place: Endpoint
    trouble: str
    names: dict[int, str] = field(default_factory=dict[int, str])
    writer: asyncio.StreamWriter | None = None
    began: float = 0.0


class TCPLink:
    """The systems behind the servers at some places; a connection that ends is made again."""

    name = "tcp"
    delivers_all = False
    fragment_size = 0

    def __init__(self, places: Collection[Endpoint]) -> None:
        self.is_far: bool = not all(is_loopback_host(place.address) for place in places)
        self._lines = [_Connection(place, f"{place} has not answered yet") for place in dict.fromkeys(places)]
        self.trouble: str = "; ".join(line.trouble for line in self._lines)
        self._tasks: list[asyncio.Task[None]] = []

    @property
    def discovery_timeout(self) -> float:
        return FAR if self.is_far else NEAR

    @property
    def awaits_answers(self) -> bool:
        return False

    async def open(self, listener: LinkListener, console: ConsoleIdentity) -> None:
        self._listener, self._console = listener, console
        tried = [asyncio.Event() for _ in self._lines]
        self._tasks = [asyncio.create_task(self._keep(*each)) for each in zip(self._lines, tried, strict=True)]
        with suppress(TimeoutError):
            async with asyncio.timeout(FIRST_TRY):
                await asyncio.gather(*(each.wait() for each in tried))

    def subscribe(self, system: str, messages: Collection[str]) -> None:
        """The vehicle's profile decides what it sends."""

    def unsubscribe(self, system: str, messages: Collection[str]) -> bool:
        """The systems send the same to all consoles."""
        return False

    def send(self, system: str, message: imc.Message, packet: bytes) -> None:
        for line in self._lines:
            if system == EVERYBODY or system in line.names.values():
                self._write(line, packet)

    async def close(self) -> None:
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def _write(self, line: _Connection, packet: bytes) -> None:
        if line.writer is None:
            return
        if line.writer.transport.get_write_buffer_size() > MOST_WAITING:
            self._listener.on_dropped(self, str(line.place), "the other side does not read")
        else:
            line.writer.write(packet)

    async def _keep(self, line: _Connection, tried: asyncio.Event) -> None:
        """Connect, again and again, and take what comes."""
        while True:
            try:
                async with asyncio.timeout(PATIENCE):
                    reader, line.writer = await asyncio.open_connection(*line.place, limit=LARGEST_PACKET)
            except TimeoutError:
                self._report_trouble(line, f"{line.place} does not answer")
            except (OSError, UnicodeError):
                self._report_trouble(line, f"nothing listens at {line.place}")
                tried.set()
            else:
                self._report_trouble(line, "")
                tried.set()
                line.began = time.monotonic()
                beating = asyncio.create_task(self._beat(line))
                trouble = ""
                try:
                    trouble = await self._read(line, reader)
                finally:
                    beating.cancel()
                    line.writer.close()
                    line.writer = None
                    self._lose(line, is_reported=trouble == CLOSED)
                self._report_trouble(line, f"{line.place} {trouble}")
            await asyncio.sleep(RETRY)

    def _report_trouble(self, line: _Connection, trouble: str) -> None:
        line.trouble = trouble
        self.trouble = "; ".join(each.trouble for each in self._lines if each.trouble)

    async def _beat(self, line: _Connection) -> None:
        next_announce = 0.0
        while True:
            if time.monotonic() >= next_announce:
                self._write(line, self._console.naming_packet(self.name))
                next_announce = time.monotonic() + PERIOD
            self._write(line, imc.encode_with_header(imc.Heartbeat(), time.time(), self._console.id, 0, 0xFFFF, 0xFF))
            await asyncio.sleep(BEAT)

    async def _read(self, line: _Connection, reader: asyncio.StreamReader) -> str:
        """Take packets until the connection ends, or is silent; which of the two."""
        parser = imc.StreamParser()
        received = since = time.monotonic()
        start = parser.incomplete_offset
        data = b"..."
        while data:
            until = received + SILENCE if start is None else min(received + SILENCE, since + LONGEST_UNFINISHED)
            packets: list[bytes] = []
            before = parser.lost
            try:
                async with asyncio.timeout(until - time.monotonic()):
                    data = await reader.read(LARGEST_PACKET)
                received = time.monotonic()
                packets = parser.feed_packets(data) if data else parser.close_packets()
            except TimeoutError:
                if time.monotonic() >= received + SILENCE:
                    return f"has sent nothing for {SILENCE:g} s"
            except OSError:
                break
            if parser.incomplete_offset != start:
                start, since = parser.incomplete_offset, time.monotonic()
            elif start is not None and time.monotonic() >= since + LONGEST_UNFINISHED:
                packets += parser.resync_packets()  # a damaged length must not hide what is behind it
                start, since = parser.incomplete_offset, time.monotonic()
            for packet in packets:
                self._take(line, packet)
            if parser.lost > before:
                self._listener.on_dropped(self, str(line.place), f"between packets: {parser.losses[-1].reason}")
        return CLOSED

    def _take(self, line: _Connection, packet: bytes) -> None:
        source = imc.header(packet).src
        if imc.packet_id(packet) == imc.Announce.ID:
            with suppress(imc.DecodeError):
                announce = imc.decode(packet)
                if isinstance(announce, imc.Announce):
                    self._name(line, source, displayable_name(announce.sys_name))
        elif source not in line.names and time.monotonic() - line.began > NAMELESS:
            self._name(line, source, f"0x{source:04X}")
        if source in line.names:
            self._listener.on_packet(self, ReceivedPacket(packet, line.names[source], "", f"at {line.place}"))

    def _name(self, line: _Connection, source: int, name: str) -> None:
        known = line.names.get(source)
        if not name or name == known or (known is None and len(line.names) >= MOST_SYSTEMS):
            return
        if known is not None:
            self._listener.on_vanished(self, known, f"{line.place} {source}", is_reported=True)
        line.names[source] = name
        self._listener.on_appeared(self, name, f"{line.place} {source}", f"at {line.place}", source)

    def _lose(self, line: _Connection, *, is_reported: bool) -> None:
        names, line.names = line.names, {}
        for source, name in names.items():
            self._listener.on_vanished(self, name, f"{line.place} {source}", is_reported=is_reported)
