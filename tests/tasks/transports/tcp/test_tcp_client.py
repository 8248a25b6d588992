"""IMC over TCP on real sockets: servers that the client connects to."""

import contextlib
import itertools
import socket
import time

import pytest

import imc
from runtime import State
from runtime.kernel import ScaledClock
from tasks.transports.tcp import client
from tasks.transports.tcp.client import Client
from tests.outside import REFUSED, free_port
from tests.runtime.devices.slow_servers import served
from tests.tasks.transports.tcp.peers import HOST, VEHICLE, Peer, packet, run, until


@pytest.mark.heavy
def test_the_client_connects_exchanges_packets_and_connects_again():
    listener = socket.create_server((HOST, 0))
    listener.setblocking(False)

    def accept():
        try:
            return Peer(listener.accept()[0])
        except BlockingIOError:
            return None

    async def test(script, task, depths):
        peer = await until(script, accept)
        await until(script, lambda: len(peer.of_type(imc.Depth)) > 3)
        peer.send(packet(imc.Heartbeat()))
        await until(script, lambda: depths.heard)
        await until(script, lambda: task.entity.state == State.NORMAL)
        peer.socket.close()
        await until(script, lambda: task.entity.state == State.FAULT)
        peer = await until(script, accept)
        await until(script, lambda: peer.of_type(imc.Depth))
        assert not [m for m in peer.take() if m.src != VEHICLE]

    with listener:
        log = run(test, Client, server_port=listener.getsockname()[1]).log
    assert sum("connected with" in line for line in log) == 3  # connected, not connected, connected


@pytest.mark.heavy
def test_the_client_waits_longer_each_time_and_says_so_once():
    port = free_port()

    async def test(script, task, depths):
        await until(script, lambda: task.backoff.failures >= 2)
        assert REFUSED in task.trouble.reason

    log = run(test, Client, server_port=port).log
    assert sum("not connected" in line for line in log) == 1


def test_the_client_of_a_scaled_vehicle_is_as_patient_as_that_of_any():
    port = free_port()

    async def test(script, task, depths):
        began = time.monotonic()
        await until(script, lambda: time.monotonic() > began + 0.5)
        assert task.backoff.failures == 1, "it has tried once"

    run(test, Client, ScaledClock(50.0), server_port=port)


SYNC = packet(imc.Heartbeat())[:2]
ENDLESS = SYNC + b"\x96\0" + b"\xea\xff"  # a packet of 60 kB begins


def trickle(peer):
    """One byte at a time, of a packet that never ends."""
    yield peer.sendall(ENDLESS)
    for _ in itertools.count():
        time.sleep(0.05)
        yield peer.sendall(b"\x07")


def babble(peer):
    while True:
        yield peer.sendall(b"\x99" * 4096)


def promise(peer):
    """Beginnings of packets that are too long to end soon, one behind the other."""
    while True:
        yield peer.sendall(ENDLESS * 600)


@pytest.mark.heavy
@pytest.mark.parametrize("silent", [trickle, lambda peer: iter(lambda: over_soon(peer), None)])
def test_a_server_that_answers_nothing_whole_is_reported_and_delays_nobody(silent, monkeypatch):
    monkeypatch.setattr(client, "SILENCE", 0.5)

    async def test(script, task, depths):
        await until(script, lambda: task.streams)
        await until(
            script, lambda: task.entity.state == State.FAULT and "has sent no packet" in task.entity.description
        )
        (stream,) = task.streams
        assert len(stream.parser._waiting) < 1 << 16
        before, times = depths.count, len(depths.times)
        await script.sleep(0.5)
        assert depths.count > before, "other tasks go on"
        assert times < len(depths.times)

    with served(silent) as port:
        log = run(test, Client, server_port=port).log
    assert sum(f"{HOST}:{port} has sent no packet for 0.5 s" in line for line in log) == 1


def over_soon(peer):
    """Nothing is sent; what comes is read."""
    with contextlib.suppress(TimeoutError):
        peer.settimeout(0.05)
        if not peer.recv(1 << 16):
            raise OSError
    return True


@pytest.mark.heavy
@pytest.mark.parametrize("endless", [babble, promise])
def test_a_server_that_sends_rubbish_without_end_is_left_counted_and_tried_again_more_rarely(endless):
    async def test(script, task, depths):
        await until(script, lambda: task.backoff.failures >= 2)
        assert task.drops["malformed"].total() > 0
        assert not task.streams or len(task.streams[0].parser._waiting) < 1 << 16
        assert depths.count > 50

    connections = []

    def speak(peer):
        connections.append(peer)
        yield from endless(peer)

    with served(speak) as port:
        log = run(test, Client, server_port=port, maximum_rate=100_000.0).log
        assert 2 <= len(connections) <= 4
    assert sum(f"{HOST}:{port}" in line and "it sends no IMC" in line for line in log) >= 1
    assert sum("have sent" in line or "has sent bytes" in line for line in log) == 1
