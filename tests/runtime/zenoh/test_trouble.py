"""A shipped vehicle on a zenoh bus: flooded from outside, and started twice."""

import re
import signal
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
import zenoh

import imc
from runtime.zenoh import ProcessPart, ZenohConfig, ZenohTransport
from tests.outside import slowness, until
from tests.runtime.zenoh.processes import PATIENCE, PEERS, Network
from tests.runtime.zenoh.vehicles import NAME, SYSTEM, Vehicle, wait_until

EXECUTING = imc.PlanControlState.State.EXECUTING


BUSY = """from runtime import Task, periodic
import time

class Busy(Task):
    @periodic(0.5)
    def work(self) -> None:
        time.sleep(0.4)
"""
KINDS = ("queries", "state in the vehicle's name", "states of many", "state of a console")


def memory(process: int) -> int:
    """Resident memory in MB."""
    found = re.search(r"VmRSS:\s+(\d+) kB", Path(f"/proc/{process}/status").read_text())
    assert found is not None
    return int(found[1]) // 1024


@pytest.mark.heavy
@pytest.mark.alone
def test_a_flood_of_20000_messages_a_second_neither_ends_nor_delays_a_run(network: Network, tmp_path: Path) -> None:
    vehicle = Vehicle(network, tmp_path)
    wait_until(lambda: list(tmp_path.rglob("*_dive")), vehicle)  # its plan has begun
    before = memory(vehicle.popen.pid)
    for kind in KINDS:
        flood = network.add(PEERS / "flood.py", network.local_port, kind, 20_000, 1.0)
        assert flood.line()["began"]
        assert flood.line()["sent"] > 2000
        assert not vehicle.ended(), vehicle.errors
    assert memory(vehicle.popen.pid) < before + 100
    flood = network.add(PEERS / "flood.py", network.local_port, KINDS[-1], 20_000, 4)
    assert flood.line()["began"]
    time.sleep(0.5)
    asked = time.monotonic()
    vehicle.popen.send_signal(signal.SIGTERM)
    assert vehicle.popen.wait(PATIENCE) == 0, vehicle.errors
    assert time.monotonic() - asked < 1.0 * slowness()

    messages = vehicle.messages()
    begin = next(m.timestamp for m in messages if isinstance(m, imc.PlanControlState) and m.state == EXECUTING)
    steps = [m.timestamp for m in messages if isinstance(m, imc.SimulatedState) and m.timestamp > begin]
    assert max(after - now for now, after in pairwise(steps)) < 0.1 * slowness()
    own = [m for m in messages if isinstance(m, imc.EstimatedState) and m.src == SYSTEM]
    assert all(m.x < 1e3 for m in own), "a state in the vehicle's name was taken from a stranger"
    assert {m.state for m in messages if isinstance(m, imc.PlanControlState) and m.timestamp > begin} == {EXECUTING}
    texts = [m.text for m in messages if isinstance(m, imc.LogBookEntry) and m.src == SYSTEM]
    assert any("in the name of this vehicle" in text for text in texts)
    told = [text for text in texts if text.startswith("dropped because too many arrive: ")]
    assert any(re.search(r"\d+ requests from 0x4001", text) for text in told)
    assert len(told) <= 4, "at most one in ten seconds, and one at the end"
    answers = [m for m in messages if isinstance(m, imc.EntityInfo) and m.timestamp > begin]
    assert len(answers) < 2000, "of 20 000 requests for 50 entities each"


@pytest.mark.heavy
def test_a_vehicle_that_is_too_busy_for_a_flood_says_whose_packets_it_dropped(network: Network, tmp_path: Path) -> None:
    (tmp_path / "busy.py").write_text(BUSY)
    vehicle = Vehicle(network, tmp_path, "--code", str(tmp_path), "--set", "busy.Busy:Enabled=Always")
    wait_until(vehicle.swims, vehicle)
    flood = network.add(PEERS / "flood.py", network.local_port, "state of a console", 20_000, 2.0)
    assert flood.line()["began"]
    sent = flood.line()["sent"]
    assert sent > 4000
    vehicle.popen.send_signal(signal.SIGTERM)
    assert vehicle.popen.wait(PATIENCE) == 0, vehicle.errors
    messages = vehicle.messages()
    texts = "\n".join(m.text for m in messages if isinstance(m, imc.LogBookEntry) and m.src == SYSTEM)
    dropped = sum(map(int, re.findall(r"dropped because too many arrive: (\d+) packets from 0x4001", texts)))
    assert dropped > 1000, texts
    taken = sum(isinstance(m, imc.EstimatedState) and m.src == 0x4001 for m in messages)
    assert taken + dropped <= sent, "each packet is taken or dropped once"


@pytest.mark.heavy
def test_a_name_that_is_on_the_network_is_refused_until_its_vehicle_has_gone(network: Network, tmp_path: Path) -> None:
    twins = [Vehicle(network, tmp_path / str(number)) for number in range(2)]
    wait_until(lambda: any(twin.ended() for twin in twins), *twins)
    first, second = sorted(twins, key=Vehicle.ended)
    wait_until(first.swims, first)
    assert not first.ended(), first.errors

    third = Vehicle(network, tmp_path / "third")
    for refused in (second, third):
        assert refused.popen.wait(PATIENCE) == 2
        refused.threads[1].join()
        assert refused.errors[-1].startswith(f"Error: {NAME} already runs on this network: on "), refused.errors
        assert f"process {first.popen.pid}, since " in refused.errors[-1]
        assert not refused.swims()

    port = f"Zenoh:Local Port={network.local_port}"
    beside = network.add("-m", "shoal.cli", "run", NAME, "-p", "Camera", "--bus", "zenoh", "--set", port)
    assert beside.popen.wait(PATIENCE) == 2, "other entities, but a second main process"
    beside.threads[1].join()
    assert beside.errors[-1].rstrip().endswith("tasks beside it need a Process in their sections, and --process")

    first.popen.kill()
    first.popen.wait()
    heir = Vehicle(network, tmp_path / "heir")
    wait_until(lambda: heir.swims() or heir.ended(), heir)
    assert not heir.ended(), heir.errors


@pytest.mark.heavy
def test_who_waits_for_a_process_that_does_not_answer_says_so(network: Network, tmp_path: Path) -> None:
    stopped = Vehicle(network, tmp_path / "stopped", "-V", "stopped")
    wait_until(stopped.swims, stopped)
    stopped.popen.send_signal(signal.SIGSTOP)
    vehicle = Vehicle(network, tmp_path / "waits")
    wait_until(lambda: vehicle.errors, vehicle)
    assert not vehicle.swims()
    assert "does not answer (stopped, or very busy); waiting up to 5 s" in vehicle.errors[0]
    wait_until(vehicle.swims, vehicle)
    assert not vehicle.ended(), vehicle.errors


def test_others_that_claim_to_be_this_vehicle_are_reported_once_in_a_while(network: Network) -> None:
    told: list[str] = []
    config = ZenohConfig(local_port=network.local_port, scouting="none", vehicle="v")
    transport = ZenohTransport(
        config, "0x{:04X}".format, lambda *_: "Daemon", part=ProcessPart("v", 1, 0b11), warn=told.append
    )
    transport.open(lambda packet: None)
    settings: Any = zenoh.Config()
    settings.insert_json5("mode", '"client"')
    settings.insert_json5("connect/endpoints", f'["tcp/127.0.0.1:{network.local_port}"]')
    with zenoh.open(settings) as session:
        liveliness = session.liveliness()
        claims = [liveliness.declare_token(f"imc/v/@run/running/{n:x}/h/1/{n:x}/ff") for n in range(100)]
        until(lambda: transport._presence is not None and len(transport._presence._others) == 100)
        assert len(claims) == 100
    transport.close()
    assert len(told) == 1
    assert told[0].startswith("v also runs on h, process 1, since 1970-01-01 ")
