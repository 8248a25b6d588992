"""A system on IMC over UDP that does only what a test tells it: announces itself, sends packets, answers or not."""

import asyncio
import contextlib
import socket
import time
from collections.abc import AsyncIterator, Iterable, Sequence

import imc
from imc.discovery import Service, Services
from imc.reserved_ids import UNKNOWN_ENTITY
from tests.runtime.zenoh.processes import local_port

OWN = 0x0B01


def discovery_ports() -> range:
    first = local_port() + 2
    return range(first, first + 5)


class Station:
    """Hears announcements at the last of the discovery ports; `consoles` is where those who announce take packets.

    `version` is what it announces of its software: Shoal carries out copies of an order once, others each copy.
    """

    def __init__(
        self,
        ports: Sequence[int],
        name: str = "station",
        system: int = OWN,
        clock: float = 0.0,
        complaint: str = "",
        version: str = "shoal",
    ) -> None:
        self.ports, self.name, self.system, self.uid = ports, name, system, str(time.time_ns())
        self.clock, self.complaint, self.version = clock, complaint, version
        self.consoles: set[tuple[str, int]] = set()
        self.heard: list[imc.Message] = []
        self.discovery = self._socket(ports[-1] if ports else 0)
        self.data = self._socket(0)

    def _socket(self, port: int) -> socket.socket:
        one = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        one.setblocking(False)
        with contextlib.suppress(OSError):
            one.bind(("127.0.0.1", port))
        return one

    def announce(self) -> None:
        place = Service("imc+udp", *self.data.getsockname())
        services = Services.from_system_info([place], uid=self.uid, version=self.version)
        packet = self.packet(imc.Announce(sys_name=self.name, sys_type=2, owner=0xFFFF, services=str(services)))
        for port in self.ports:
            self.data.sendto(packet, ("127.0.0.1", port))

    def packet(self, message: imc.Message) -> bytes:
        entity = 0 if message.src_ent == UNKNOWN_ENTITY else message.src_ent
        return imc.encode_with_header(message, time.time() + self.clock, self.system, entity, message.dst, 0xFF)

    def send(self, *packets: bytes) -> None:
        for packet in packets:
            for console in self.consoles:
                self.data.sendto(packet, console)

    def answers(self, message: imc.Message) -> Iterable[imc.Message]:
        """What it answers to a message, for stations that answer."""
        return ()

    def listen(self) -> None:
        for one in (self.discovery, self.data):
            with contextlib.suppress(BlockingIOError, OSError):
                while True:
                    message = imc.decode(one.recv(65536))
                    if message.src == self.system:
                        continue
                    self.heard.append(message)
                    self.send(*map(self.packet, self.answers(message)))
                    if self.complaint and isinstance(message, imc.EntityList):
                        self.send(self.packet(imc.LogBookEntry(text=self.complaint.format(message.src))))
                    if isinstance(message, imc.Announce):
                        self.consoles |= set(Services.parse(message.services).endpoints("imc+udp"))

    async def live(self, *, announces: bool, beats: bool, also: Sequence[bytes] = ()) -> None:
        """Ten times a second: listen, announce, send Heartbeat and other packets."""
        while True:
            self.listen()
            if announces:
                self.announce()
            self.send(*([self.packet(imc.Heartbeat())] if beats else []), *also)
            await asyncio.sleep(0.1)

    def close(self) -> None:
        self.discovery.close()
        self.data.close()


@contextlib.asynccontextmanager
async def living(
    station: Station, *, announces: bool = True, beats: bool = True, also: Sequence[bytes] = ()
) -> AsyncIterator[Station]:
    task = asyncio.create_task(station.live(announces=announces, beats=beats, also=also))
    try:
        yield station
    finally:
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task
        station.close()
