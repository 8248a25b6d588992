"""Vehicles on one computer, reached over zenoh and over UDP: each message of others comes once."""

import signal
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import imc
from runtime.zenoh import ProcessPart, ZenohConfig, ZenohTransport
from tests.outside import until
from tests.runtime.zenoh.processes import PATIENCE, Network
from tests.runtime.zenoh.vehicles import Vehicle, wait_until
from tests.shoal.network.station import Station

NAMES = ("first", "second")
CONSOLE = 0x4042


@pytest.mark.heavy
def test_two_vehicles_hear_each_other_and_a_console_once_though_both_networks_reach(
    network: Network, tmp_path: Path
) -> None:
    vehicles = [Vehicle(network, tmp_path / name, "-V", name, udp=True) for name in NAMES]
    console = Station(network.discovery_ports, "ccu", CONSOLE)
    for vehicle in vehicles:
        wait_until(vehicle.swims, vehicle)
    end = time.monotonic() + 4.0  # a contact over UDP is made within a second
    while time.monotonic() < end:
        console.listen()
        console.announce()
        console.send(console.packet(imc.Heartbeat()))
        time.sleep(0.2)
    console.close()
    for vehicle in vehicles:
        vehicle.popen.send_signal(signal.SIGTERM)
    for vehicle in vehicles:
        assert vehicle.popen.wait(PATIENCE) == 0, vehicle.errors
        messages = vehicle.messages()
        times = Counter((m.src, m.src_ent, m.timestamp) for m in messages if isinstance(m, imc.EstimatedState))
        assert len({source for source, _, _ in times}) >= 2, "it heard the other one"
        assert max(times.values()) == 1, "a message came over both networks"
        for kind in (imc.Heartbeat, imc.Announce):
            said = Counter(m.timestamp for m in messages if isinstance(m, kind) and m.src == CONSOLE)
            assert len(said) > 4, "it heard the console"
            assert max(said.values()) == 1, "the other vehicle has passed on what the console said to both"
        texts = [m.text for m in messages if isinstance(m, imc.LogBookEntry)]
        assert not [text for text in texts if "may not send them" in text]


def test_what_a_system_beyond_the_bus_says_to_all_goes_to_the_other_processes_of_its_hearer_only(
    network: Network,
) -> None:
    def joined(name: str, system: int, process: str, entities: int) -> tuple[ZenohTransport, list[imc.Message]]:
        config = ZenohConfig(local_port=network.local_port, scouting="none", vehicle=name)
        part = ProcessPart(name, system, entities, process)
        transport = ZenohTransport(config, lambda number: f"0x{number:04X}", lambda *_: "Daemon", part=part)
        heard: list[imc.Message] = []
        transport.open(lambda packet: heard.append(imc.decode(packet)))
        return transport, heard

    with ThreadPoolExecutor() as pool:
        places = ("first", 1, "main", 0b001), ("first", 1, "vision", 0b010), ("second", 2, "main", 0b001)
        (hearer, _), (vision, inside), (other, outside) = pool.map(lambda place: joined(*place), places)

    def say(message: imc.Message) -> None:
        hearer.send(message, imc.encode(message))

    def met() -> bool:
        say(imc.Depth(src=1))
        return all(any(isinstance(m, imc.Depth) for m in heard) for heard in (inside, outside))

    until(met)
    said = [imc.Heartbeat(src=CONSOLE, dst=to) for to in (0xFFFF, 0xFFF0, 0)]
    for message in (*said, imc.Abort(src=CONSOLE, dst=1), imc.Abort(src=CONSOLE, dst=2), imc.Salinity(src=1)):
        say(message)
    for heard in (inside, outside):
        until(lambda heard=heard: any(isinstance(m, imc.Salinity) for m in heard))
    until(lambda: [m.dst for m in inside if isinstance(m, imc.Abort)] == [1, 2])
    until(lambda: [m.dst for m in inside if isinstance(m, imc.Heartbeat)] == [0xFFFF, 0xFFF0, 0])
    assert not [m for m in outside if isinstance(m, imc.Heartbeat)]
    for transport in (hearer, vision, other):
        transport.close()


@pytest.mark.heavy
def test_vehicles_that_end_together_end_at_once(network: Network, tmp_path: Path) -> None:
    """Each sees the other one go while it leaves; zenoh must not wait there for the interpreter."""
    for round_number in range(10):
        vehicles = [Vehicle(network, tmp_path / f"{round_number}-{name}", "-V", name) for name in NAMES]
        for vehicle in vehicles:
            wait_until(vehicle.swims, vehicle)
        for vehicle in vehicles:
            vehicle.popen.send_signal(signal.SIGTERM)
        for vehicle in vehicles:
            assert vehicle.popen.wait(PATIENCE) == 0, vehicle.errors
