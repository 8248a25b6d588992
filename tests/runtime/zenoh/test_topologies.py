"""Peers, clients and routers in processes of their own: a router that dies, a subscriber that stalls."""

import json
import time

import pytest

from runtime.zenoh.config import SESSION_OFFSET
from tests.outside import slowness
from tests.runtime.zenoh.processes import PEERS, Network, Process, hear_each_other, local_port

CLIENT, PEER = 1, 2
BACK = 5.0  # s from the return of a router until all hear each other


def send(process: Process, abbrev: str, **fields: object) -> None:
    process.ask("send " + json.dumps({"abbrev": abbrev, **fields}))


@pytest.mark.heavy
def test_a_client_and_a_peer_of_a_router_meet_again_when_it_comes_back_and_know_what_they_missed(
    network: Network,
) -> None:
    port = local_port()

    def router() -> Process:
        process = network.add(PEERS / "plainly.py", "router", port)
        assert process.line() == {"opened": True}
        return process

    first = router()
    endpoint = f"tcp/127.0.0.1:{port}"
    client = network.bus(CLIENT, scouting=False, Mode="client", Connect=endpoint)
    peer = network.bus(PEER, scouting=False, Connect=endpoint, Local_Port=str(local_port()))
    for process in (client, peer):
        assert process.line() == {"opened": True}
        process.ask("flow 50")
    hear_each_other({CLIENT: client, PEER: peer})

    first.end()
    time.sleep(1.0)
    send(client, "VehicleState")
    send(peer, "PlanControlState")
    assert "VehicleState" not in peer.ask("status")["names"]
    router()
    back = time.monotonic()
    hear_each_other({CLIENT: client, PEER: peer})
    assert time.monotonic() - back < BACK * slowness()
    client.until(lambda status: "PlanControlState" in status["names"])
    peer.until(lambda status: "VehicleState" in status["names"])
    send(peer, "PlanControl", dst=CLIENT)
    client.until(lambda status: "PlanControl" in status["names"])


@pytest.mark.heavy
@pytest.mark.alone
def test_subscribers_that_stall_for_ten_seconds_delay_nobody_else(network: Network) -> None:
    sender, receiver = network.buses(1, 2, scouting=False)
    ports = {"client": network.local_port, "peer": network.local_port + SESSION_OFFSET}
    stallers = [network.add(PEERS / "plainly.py", "staller", port, mode) for mode, port in ports.items()]
    assert [staller.line() for staller in stallers] == [{"opened": True}] * 2
    assert [staller.line() for staller in stallers] == [{"stalls": 10.0}] * 2
    began = time.monotonic()
    sender.ask("flow 1000")
    sender.ask("reset")
    before = receiver.ask("status")
    commands, text = 0, "x" * 40_000
    longest = 0.0
    while time.monotonic() - began < 7.0:  # of the 10 s; one may begin to stall later than the other
        asked = time.monotonic()
        send(sender, "LogBookEntry", dst=2, text=text)
        commands += 1
        receiver.until(lambda status, number=commands: status["names"].get("LogBookEntry", 0) == number)
        receiver.hears(1, 1)
        longest = max(longest, time.monotonic() - asked)
    assert all(staller.lines.empty() for staller in stallers), "they stall still"
    assert longest < 0.5 * slowness()
    assert commands * len(text) > 8_000_000, "more than the buffers on the way hold"
    status = sender.ask("flow 0")
    assert status["worst_send"] < 0.1 * slowness()
    assert status["unsent"] == 0
    heard = receiver.ask("status")
    assert heard["heard"]["1"][2], "in order, each once"
    assert heard["lost"] == before["lost"]
