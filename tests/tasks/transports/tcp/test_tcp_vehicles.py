"""Other vehicles that connect to the TCP server of a vehicle."""

import imc
from tests.tasks.transports.tcp.peers import SILENT_FOR, Peer, packet, run, until


def announce(system, kind=imc.SystemType.UUV):
    return packet(imc.Announce(sys_name="lauv-xplore-2", sys_type=kind), system, target=0)


def test_another_vehicle_that_connects_gets_nothing():
    """The last states would stop a plan of DUNE: it is known by its first packet, or by its Announce before."""

    async def test(script, server, depths):
        peer = Peer.of(server.open_port)
        peer.send(announce(0x001B))
        console = Peer.of(server.open_port)
        console.send(packet(imc.Heartbeat()))
        await until(script, lambda: len(console.of_type(imc.Depth)) > 5)
        assert peer.take() == []
        again = Peer.of(server.open_port)
        again.send(packet(imc.EstimatedState(), 0x001B))
        await script.sleep(SILENT_FOR + 0.2)
        assert again.take() == []
        peer.send(announce(0x001B, imc.SystemType.CCU))
        await until(script, lambda: peer.of_type(imc.Depth))

    assert any("is another vehicle and gets nothing" in line for line in run(test, transports=["Depth"]).log)


def test_another_vehicle_whose_announce_comes_after_its_first_data_gets_nothing():
    """As after a restart of this vehicle: a DUNE that is connected announces itself every 10 s only."""

    async def test(script, server, depths):
        peer = Peer.of(server.open_port)
        peer.send(packet(imc.EstimatedState(), 0x001B))
        await script.sleep(SILENT_FOR + 0.2)
        peer.send(announce(0x001B))
        await script.sleep(0.5)
        assert peer.take() == []

    run(test, transports=["Depth"])


def test_another_vehicle_that_call_systems_names_gets_messages_when_it_connects():
    async def test(script, server, depths):
        peer = Peer.of(server.open_port)
        peer.send(announce(0x001B))
        await until(script, lambda: peer.of_type(imc.Depth))

    run(test, transports=["Depth"], call_systems=["0x001B"])
