"""IMC over TCP on real sockets: servers that the client connects to."""

import socket
import time

import pytest

import imc
from runtime import State
from runtime.kernel import ScaledClock
from tasks.transports.tcp.client import Client
from tests.outside import REFUSED
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
    with socket.create_server((HOST, 0)) as gone:
        port = gone.getsockname()[1]

    async def test(script, task, depths):
        await until(script, lambda: task.pause >= 4.0)
        assert REFUSED in task.trouble

    log = run(test, Client, server_port=port).log
    assert sum("not connected" in line for line in log) == 1


def test_the_client_of_a_scaled_vehicle_is_as_patient_as_that_of_any():
    with socket.create_server((HOST, 0)) as gone:
        port = gone.getsockname()[1]

    async def test(script, task, depths):
        began = time.monotonic()
        await until(script, lambda: time.monotonic() > began + 0.5)
        assert task.pause == 2.0, "it has tried once"

    run(test, Client, ScaledClock(50.0), server_port=port)
