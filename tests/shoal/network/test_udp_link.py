"""How a console meets systems over UDP, and keeps them."""

import asyncio
import time

import pytest

import imc
from shoal.network import ConsoleIdentity, UDPLink, udp_link
from tests.shoal.network.station import Station, discovery_ports


class Ear:
    """Takes note of who is there."""

    def __init__(self):
        self.there, self.beats = set(), 0

    def on_appeared(self, link, system, part, place, number=None):
        self.there.add(system)

    def on_vanished(self, link, system, part, *, is_reported):
        self.there.discard(system)

    def on_packet(self, link, arrival):
        self.beats += imc.packet_id(arrival.packet) == imc.Heartbeat.ID

    def on_dropped(self, link, peer, reason, number=1):
        pass


async def until(condition, seconds=5.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it does not happen"
        await asyncio.sleep(0.01)


@pytest.mark.heavy
def test_a_system_behind_a_network_that_was_cut_is_back_before_it_announces_itself(monkeypatch):
    """It has lost us, too: it sends again once it has heard us, and announces itself every 10 s only."""
    monkeypatch.setattr(udp_link, "SILENCE", 0.3)

    async def act():
        ports = discovery_ports()
        station, listener, link = Station(ports), Ear(), UDPLink(ports=ports)

        def speaks():
            station.listen()
            if station.heard:
                station.send(station.packet(imc.Heartbeat()))
            return listener.beats

        await link.open(listener, ConsoleIdentity(0x4321, "test"))
        station.announce()
        await until(speaks)
        await until(lambda: not listener.there)
        station.listen()
        station.heard, listener.beats = [], 0
        await until(speaks, 2.5)
        assert listener.there == {"station"}
        station.close()
        await link.close()

    asyncio.run(act())


def test_a_console_whose_id_is_none_of_consoles_gets_any_port():
    async def act():
        link = UDPLink(ports=discovery_ports())
        await link.open(Ear(), ConsoleIdentity(0xFFF0, "console"))
        await link.close()
        return link.trouble

    assert asyncio.run(act()) == ""
