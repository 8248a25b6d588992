"""The zenoh transport between processes: real sessions, killed, stopped and restarted."""

import contextlib
import json
import queue
import signal
import socket
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import imc
from runtime.bus import Bus, Subscription
from runtime.kernel import SECOND, Kernel, WallClock
from runtime.zenoh import ZenohConfig, ZenohTransport
from tests.runtime.bus.transport_contract import FIRST, SECOND_, Link, TransportContract
from tests.runtime.zenoh.processes import PATIENCE, PEERS, Network, Process, hear_each_other, local_port


@pytest.mark.heavy
def test_two_processes_hear_each_other_in_order_and_close_under_traffic(network: Network) -> None:
    first, second = network.buses(1, 2)
    for process, other in ((first, 2), (second, 1)):
        status = process.hears(other, 50)
        _, _, in_order = status["heard"][str(other)]
        assert in_order
        assert set(status["heard"]) == {str(other)}, "a process does not hear itself"
        assert (status["lost"], status["malformed"], status["unsent"]) == (0, 0, 0)
    assert "closed" in first.ask("close")
    assert first.wait() == 0
    second.ask("status")
    assert "closed" in second.ask("close")
    assert second.wait() == 0


def test_plain_subscribers_get_packets_that_imcpy_decodes(network: Network) -> None:
    peer = network.plain("imc/**", "peer")
    bus = network.bus(30)
    assert bus.line() == peer.line() == {"opened": True}
    client = network.plain("imc/*/@cmd/**", "client")
    assert client.line() == {"opened": True}

    def publish(abbrev: str, **fields: object) -> Callable[[], object]:
        return lambda: bus.ask("send " + json.dumps({"abbrev": abbrev, **fields}))

    told = first_answer(peer, publish("EstimatedState", x=1.5))
    assert told == {
        "key": "imc/system-30/EstimatedState/Navigation",
        "encoding": "application/octet-stream;imc/5.4.31",
        "priority": "DATA",
        "abbrev": "EstimatedState",
        "src": 30,
        "x": 1.5,
        "label": None,
    }
    told = first_answer(peer, publish("Announce", dst=0))  # as in DUNE
    if told["abbrev"] != "Announce":
        told = peer.line_where(abbrev="Announce")
    assert (told["key"], told["priority"]) == ("imc/system-30/Announce/Navigation", "DATA")
    told = first_answer(client, publish("SetEntityParameters", dst=31, name="Navigation"))
    assert (told["key"], told["priority"]) == ("imc/system-31/@cmd/SetEntityParameters/system-30", "REAL_TIME")
    told = first_answer(peer, publish("Abort"))
    if told["abbrev"] != "Abort":
        told = peer.line_where(abbrev="Abort")
    assert (told["key"], told["priority"]) == ("imc/system-30/Abort/Navigation", "REAL_TIME")


def first_answer(process: Process, publish: Callable[[], object]) -> Any:
    """The first output of a subscriber while `publish` is repeated, since it may not be connected yet."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        publish()
        with contextlib.suppress(queue.Empty):
            return process.lines.get(timeout=0.1)
    raise AssertionError(f"heard nothing: {process.errors}")


def test_commands_reach_the_other_processes(network: Network) -> None:
    first, second = network.buses(1, 2)
    first.ask('send {"abbrev": "SetEntityParameters", "dst": 9}')
    first.ask('send {"abbrev": "Abort"}')
    second.until(lambda status: {"SetEntityParameters", "Abort"} <= set(status["names"]))


@pytest.mark.heavy
@pytest.mark.parametrize("scouting", [True, False])
def test_three_processes_survive_the_death_of_the_one_that_listens(network: Network, scouting: bool) -> None:
    running = dict(zip((1, 2, 3), network.buses(1, 2, 3, scouting=scouting), strict=True))
    client = network.plain("imc/**", "client")
    assert client.line() == {"opened": True}
    client.line()
    for victim in (1, 2):
        killed = running.pop(victim)
        killed.popen.send_signal(signal.SIGKILL)
        killed.popen.wait()
        hear_each_other(running)
        client.lines.queue.clear()
        for survivor in running:
            client.line_where(src=survivor)
        running[victim] = network.bus(victim, scouting=scouting)
        assert running[victim].line() == {"opened": True}
        running[victim].ask("flow 100")
        hear_each_other(running)


@pytest.mark.heavy
def test_a_stopped_process_delays_nobody_and_comes_back(network: Network) -> None:
    first, second, third = network.buses(1, 2, 3)
    second.popen.send_signal(signal.SIGSTOP)
    first.ask("flow 2000")
    third.hears(1, 2000)
    first.hears(3, 20)
    first.ask("flow 100")
    second.popen.send_signal(signal.SIGCONT)
    second.hears(1, 20)
    first.hears(2, 20)
    third.popen.send_signal(signal.SIGSTOP)
    assert "closed" in first.ask("close")
    assert first.wait() == 0
    assert second.wait() == 0, "ends by itself, without having closed"


@pytest.mark.heavy
def test_a_bus_that_does_not_listen_loses_counted_packets(network: Network) -> None:
    first, second = network.buses(1, 2)
    second.ask("deaf")
    before = first.ask("status")["sent"]
    first.ask("flow 20000")
    first.until(lambda status: status["sent"] > before + 6000)
    sent = first.ask("flow 100")["sent"]
    second.ask("hear")
    status = second.until(lambda status: status["heard"]["1"][1] > sent)
    number, last, _ = status["heard"]["1"]
    assert status["lost"] > 0
    assert number + status["lost"] <= last
    assert any("lost on the way" in line for line in second.errors)


def test_garbage_is_counted_and_costs_nothing_else(network: Network) -> None:
    (bus,) = network.buses(1)
    foreign = network.add(PEERS / "foreign.py", network.local_port)
    assert foreign.line() == {"published": 6}
    status = bus.until(lambda status: status["heard"].get("77") and status["malformed"] >= 4)
    assert status["heard"]["77"] == [1, 5.0, True]
    assert status["malformed"] == 4
    assert status["oversize"] == 2
    assert sum("too large for a packet" in line for line in bus.errors) == 1


@pytest.mark.heavy
def test_a_packet_under_a_key_with_wildcards_arrives_once_each_time_it_is_sent() -> None:
    zenoh = pytest.importorskip("zenoh")
    config = ZenohConfig(local_port=local_port(), scouting="none")
    transport = ZenohTransport(config, lambda system: f"system-{system}", lambda *_: "Tank")
    packet = imc.encode(imc.Abort(src=0x4001, timestamp=1.0))
    received: queue.Queue[bytes] = queue.Queue()
    transport.open(received.put)
    client = zenoh.Config.from_json5(
        f'{{mode: "client", connect: {{endpoints: ["tcp/127.0.0.1:{config.local_port}"]}}}}'
    )
    try:
        with zenoh.open(client) as session:
            for _ in range(2):
                session.put("imc/**", packet)
                assert received.get(timeout=PATIENCE) == packet
                time.sleep(0.6)
            assert received.empty()
    finally:
        transport.close()


@pytest.mark.heavy
def test_a_port_held_by_something_else_keeps_nobody_apart_and_is_taken_over(network: Network) -> None:
    with socket.socket() as other:
        other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # earlier tests left connections in TIME_WAIT
        other.bind(("127.0.0.1", network.local_port))
        other.listen()
        first, _ = network.buses(1, 2)
    first.until(lambda _: accepts(network.local_port))
    client = network.plain("imc/**", "client")
    assert client.line() == {"opened": True}
    assert client.line()["src"] in (1, 2)


def accepts(port: int) -> bool:
    with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port)):
        return True
    return False


PROFILE = """
[General]
Vehicle = lauv-test-1
Bus = zenoh

[Zenoh]
Local Port = {0.local_port}
Scouting Address = 224.0.0.224:{0.scouting_port}

[IMC Addresses]
lauv-test-1 = 0x001f

[Simulators.EstimatedState]
Enabled = Simulation
Start Latitude = 41.185
Bottom Depth = 13

[Transports.Logging]
Enabled = Simulation

[Simulators.MUGDetectionCamera]
Enabled = Simulation
Process = camera
Entity Label = MUG Camera
MUGs = 0 0
"""


@pytest.mark.heavy
def test_a_vehicle_in_two_processes_is_one_vehicle(network: Network, tmp_path: Path) -> None:
    profile = tmp_path / "lauv-test-1.ini"
    profile.write_text(PROFILE.format(network))
    ground_station = network.plain("imc/lauv-test-1/**", "peer")
    inside = network.plain("imc/lauv-test-1/@cmd/**", "peer")

    def run(*words: str) -> Process:
        return network.add("-m", "shoal.cli", "run", profile, "-p", "Simulation", "--log-dir", tmp_path / "log", *words)

    assert ground_station.line() == inside.line() == {"opened": True}
    camera = run("--process", "camera")
    vehicle = run("--alone")
    key = "imc/lauv-test-1/EstimatedMugState/MUG_Camera"
    assert ground_station.line_where(key=key)["src"] == 0x001F
    inside.line_where(abbrev="EntityInfo", label="MUG Camera")

    camera.popen.send_signal(signal.SIGKILL)
    camera.popen.wait()
    camera = run("--process", "camera")
    ground_station.lines.queue.clear()
    for _ in range(5):
        ground_station.line_where(key=key)

    for process in (vehicle, camera):
        process.popen.terminate()
        assert process.wait() == 0, process.errors
    (log,) = (tmp_path / "log").rglob("Data.lsf*")
    logged = list(imc.Log(log.parent))
    assert {"EstimatedMugState", "EstimatedState"} <= {type(message).__name__ for message in logged}
    assert "MUG Camera" in {message.label for message in logged if isinstance(message, imc.EntityInfo)}


class TestZenoh(TransportContract):
    @pytest.fixture
    def link(self) -> Iterator[Link]:
        config = ZenohConfig(local_port=local_port(), scouting="none")
        kernels = [Kernel(WallClock()) for _ in range(2)]
        buses = [Bus(kernel, system) for kernel, system in zip(kernels, (FIRST, SECOND_), strict=True)]
        transports = [ZenohTransport(config, lambda system: f"system-{system}", lambda *_: "Tank") for _ in buses]
        for bus, transport in zip(buses, transports, strict=True):
            bus.release_backlog()
            bus.attach_transport(transport)

        def run() -> None:
            for kernel in kernels:
                kernel.run(until=kernel.clock.read() + SECOND // 50)

        link = Link(buses[0], buses[1], transports[0], run)
        met: set[int] = set()
        for bus in buses:
            bus.subscribe(Subscription(imc.Heartbeat, lambda message: met.add(message.src), others=True))

        def have_met() -> bool:
            for bus in buses:
                beat = imc.Heartbeat(src=bus.system)
                transports[buses.index(bus)].send(beat, imc.encode(beat))
            return met == {FIRST, SECOND_}

        link.until(have_met)
        link.settle()
        yield link
        for bus, kernel in zip(buses, kernels, strict=True):
            bus.close_transports()
            kernel.close()
