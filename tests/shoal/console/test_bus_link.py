"""The link between a vehicle and its own page."""

import asyncio

import pytest

from shoal.console import BusLink
from shoal.network import Network
from tasks.transports.console import PagePackets


class Task:
    """The side of the vehicle, which has a packet for the page."""

    system_name, system = "lauv-noptilus-1", 0x1A

    def connect_page(self, console, wake):
        packets = PagePackets(console, wake)
        packets.take = lambda: [b"packet"]
        return packets

    def set_watched(self, is_watched):
        pass

    def __init__(self):
        self.wanted = []

    def request_messages(self, names):
        self.wanted += [name for name in names or [""] if name not in self.wanted]

    def release_messages(self, names):
        for name in names or [""]:
            self.wanted.remove(name)


def test_a_link_that_fails_reports_it_and_raises_at_the_end(monkeypatch):
    def fail(network, link, arrival):
        raise ZeroDivisionError

    monkeypatch.setattr(Network, "on_packet", fail)

    async def run():
        link, ended = BusLink(Task()), asyncio.Event()
        link.on_end = ended.set
        async with Network([link]):
            await asyncio.wait_for(ended.wait(), 10.0)

    with pytest.raises(ZeroDivisionError):
        asyncio.run(run())


def test_what_is_also_wanted_of_everybody_is_kept_for_the_page():
    task = Task()
    link = BusLink(task)
    link.subscribe("*", ["FuelLevel", "Heartbeat"])
    link.subscribe("lauv-noptilus-1", ["FuelLevel", "Temperature"])
    link.subscribe("*", [])
    link.unsubscribe("lauv-noptilus-1", ["FuelLevel"])
    link.unsubscribe("lauv-noptilus-1", ["Temperature"])
    assert task.wanted == ["FuelLevel", "Heartbeat", ""]
    link.unsubscribe("*", [])
    assert task.wanted == ["FuelLevel", "Heartbeat"]
