"""A hand on a shipped vehicle over TCP, and on servers that are not vehicles of Shoal."""

import asyncio
import contextlib
import socket
import time
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

import imc
import shoal
from shoal.network import Network, ZenohLink, make_network
from tasks.transports.announce import Announce
from tasks.transports.tcp.server import Server
from tests.tasks.transports.imc_station import afloat

NAME = "lauv-noptilus-1"
OWN = 0x0B01


def packet(message: imc.Message) -> bytes:
    return imc.encode_with_header(message, time.time(), OWN, 0, 0xFFFF, 0xFF)


@contextlib.asynccontextmanager
async def serving(*packets: bytes, port: int = 0) -> AsyncIterator[int]:
    """A server that sends some packets to everybody, ten times a second."""

    async def serve(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(OSError):
            while True:
                writer.writelines(packets)
                await writer.drain()
                await asyncio.sleep(0.1)

    server = await asyncio.start_server(serve, "127.0.0.1", port)
    try:
        yield server.sockets[0].getsockname()[1]
    finally:
        server.close()


def reaching(port: int) -> Network:
    return make_network([f"imc+tcp://127.0.0.1:{port}"])


@pytest.mark.heavy
def test_a_vehicle_is_found_by_its_name_commanded_and_missed_when_it_ends(tmp_path: Path) -> None:
    with contextlib.ExitStack() as stack:
        running = stack.enter_context(afloat(tmp_path, "Transports.TCP.Server:Port=0"))
        server, announcer = (running.vehicle.task(f"Transports.{name}") for name in ("TCP.Server", "Announce"))
        assert isinstance(server, Server)
        assert isinstance(announcer, Announce)
        port = server.open_port
        running.until(lambda: announcer.sent)
        with shoal.connect(NAME, endpoints=[f"imc+tcp://localhost:{port}"]) as vehicle:
            assert vehicle.id == 0x001A
            assert vehicle.latest(imc.EstimatedState).lat == pytest.approx(0.7188, abs=1e-3)
            assert vehicle.latest(imc.FuelLevel, timeout=2.0).value > 0.0
            step = imc.PlanManeuver(maneuver_id="wait", data=imc.IdleManeuver(duration=9))
            vehicle.plan.put(imc.PlanSpecification(plan_id="survey", start_man_id="wait", maneuvers=(step,)))
            assert "survey" in [plan.name for plan in vehicle.plan.list()]
            stack.close()
            with pytest.raises(shoal.NetworkError, match="is gone"):
                for _ in vehicle.messages(imc.VehicleState):
                    pass


@pytest.mark.heavy
def test_a_system_that_does_not_announce_itself_is_called_by_its_id_until_it_does() -> None:
    async def act() -> None:
        async with serving(packet(imc.Heartbeat())) as port, reaching(port) as net:
            assert (await net.find_system("0x0B01")).id == OWN
        announce = packet(imc.Announce(sys_name="buoy", services=""))
        async with serving(packet(imc.Heartbeat()), announce) as port, reaching(port) as net:
            assert (await net.find_system("buoy")).id == OWN
            assert [system.name for system in net.vehicles()] == ["buoy"]

    asyncio.run(act())


@pytest.mark.heavy
def test_a_server_that_is_not_there_yet_is_named_and_connected_to_later() -> None:
    async def act() -> None:
        async with serving() as port:
            pass
        async with reaching(port) as net:
            assert net.search.no_vehicle_text() == f"no vehicle is on the network (nothing listens at 127.0.0.1:{port})"
            async with serving(packet(imc.Announce(sys_name="buoy", services="")), port=port):
                assert (await net.find_system("buoy", 5.0)).id == OWN

    asyncio.run(act())


def test_a_server_that_does_not_answer_and_one_that_is_silent_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shoal.network.tcp_link.SILENCE", 0.1)

    async def act() -> None:
        with contextlib.ExitStack() as stack:
            full = stack.enter_context(socket.create_server(("127.0.0.1", 0), backlog=0))
            for _ in range(2):  # what comes after these gets no answer, as behind a firewall
                one = stack.enter_context(socket.socket())
                one.setblocking(False)
                one.connect_ex(full.getsockname())
            place = f"127.0.0.1:{full.getsockname()[1]}"
            async with reaching(full.getsockname()[1]) as net:
                assert net.search.no_vehicle_text() == f"no vehicle is on the network ({place} has not answered yet)"
        assert (
            Network([ZenohLink([f"tcp/{place}"])])
            .search.no_vehicle_text()
            .endswith(f"(tcp/{place} has not answered yet)")
        )
        async with serving() as port, reaching(port) as net:
            async with asyncio.timeout(10.0):
                while "has sent nothing for 0.1 s" not in net.search.no_vehicle_text():
                    await asyncio.sleep(0.01)

    asyncio.run(act())


def test_what_is_no_imc_is_counted() -> None:
    async def act() -> None:
        async with serving(b"HTTP/1.1 400 Bad Request\r\n\r\n") as port, reaching(port) as net:
            async with asyncio.timeout(5.0):
                while not net.unknown_drops:
                    await asyncio.sleep(0.02)
            assert [peer for peer, _ in net.unknown_drops] == [f"127.0.0.1:{port}"]

    asyncio.run(act())


@pytest.mark.heavy
def test_a_damaged_length_hides_what_is_behind_it_for_a_second_only() -> None:
    async def act() -> None:
        beat = packet(imc.Heartbeat())
        damaged = beat[:4] + (60000).to_bytes(2, "little") + beat[6:]
        announce = packet(imc.Announce(sys_name="buoy", services=""))
        async with serving(damaged, announce) as port, reaching(port) as net:
            assert (await net.find_system("buoy", 10.0)).id == OWN
            assert [what for _, what in net.unknown_drops] == ["between packets: truncated"]

    asyncio.run(act())


@pytest.mark.parametrize("endpoint", ["imc+tcp://0.0.0.0:7001/", "imc+tcp://", "imc+ftp://10.0.0.7/", "imc+tcp://a:0"])
def test_wrong_endpoints_are_named(endpoint: str) -> None:
    with pytest.raises(ValueError, match="is not"):
        make_network([endpoint])
