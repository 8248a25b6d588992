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
@pytest.mark.parametrize("mode", ["client", "peer"])
def test_a_subscriber_that_stalls_for_ten_seconds_delays_nobody_else(network: Network, mode: str) -> None:
    sender, receiver = network.buses(1, 2, scouting=False)
    port = network.local_port if mode == "client" else network.local_port + SESSION_OFFSET
    staller = network.add(PEERS / "plainly.py", "staller", port, mode)
    assert staller.line() == {"opened": True}
    assert staller.line() == {"stalls": 10.0}
    began = time.monotonic()
    sender.ask("flow 1000")
    sender.ask("reset")
    before = receiver.ask("status")
    commands, text = 0, "x" * 40_000
    longest = 0.0
    while time.monotonic() - began < 9.0:  # most of the time that it stalls
        asked = time.monotonic()
        send(sender, "LogBookEntry", dst=2, text=text)
        commands += 1
        receiver.until(lambda status, number=commands: status["names"].get("LogBookEntry", 0) == number)
        receiver.hears(1, 1)
        longest = max(longest, time.monotonic() - asked)
    assert staller.lines.empty(), "it stalls still"
    assert longest < 0.5 * slowness()
    assert commands * len(text) > 8_000_000, "more than the buffers on the way hold"
    status = sender.ask("flow 0")
    assert status["worst_send"] < 0.1 * slowness()
    assert status["unsent"] == 0
    heard = receiver.ask("status")
    assert heard["heard"]["1"][2], "in order, each once"
    assert heard["lost"] == before["lost"]
