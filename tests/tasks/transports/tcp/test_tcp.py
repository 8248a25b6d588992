"""IMC over TCP on real sockets: clients of the server, and servers of the client."""

import socket
import struct
import time

import imcpy
import pytest

import imc
from runtime.kernel import ScaledClock, WallClock, parse_clock
from runtime.profile import load_profile
from runtime.testing import simulate
from runtime.vehicle import build
from tasks.transports.imc_links.stream_links import LONGEST_WAIT
from tasks.transports.tcp.server import Server
from tests.tasks.transports.tcp.peers import CONSOLE, HOST, VEHICLE, Peer, packet, run, until


def test_each_client_gets_what_the_vehicle_says_and_is_received_without_an_announce():
    async def test(script, server, depths):
        peers = [Peer.of(server.open_port), Peer.of(server.open_port)]
        for peer in peers:
            await until(script, lambda peer=peer: len(peer.of_type(imc.Depth)) > 5)
            values = [message.value for message in peer.of_type(imc.Depth)]
            assert values == [values[0] + i for i in range(len(values))]
            assert {message.src for message in peer.heard} == {VEHICLE}
        peers[0].send(packet(imc.Heartbeat()))
        peers[1].send(packet(imc.Abort(), 0x4001, "big"))
        await until(script, lambda: len(depths.heard) == 2)
        assert {(type(m), m.src) for m in depths.heard} == {(imc.Heartbeat, CONSOLE), (imc.Abort, 0x4001)}
        await script.sleep(0.1)
        assert not [m for peer in peers for m in peer.take() if m.src != VEHICLE]  # no echo

    done = run(test)
    (service,) = done.of(imc.AnnounceService)
    assert service.service.startswith("imc+tcp://127.0.0.1:")
    assert service.service.endswith("/")


def test_who_connects_is_told_the_last_state():
    async def test(script, server, depths):
        depths.publish(imc.FuelLevel(value=70.0))
        await script.sleep(0.05)
        peer = Peer.of(server.open_port)
        await until(script, lambda: [message.value for message in peer.of_type(imc.FuelLevel)] == [70.0])

    run(test, transports=["FuelLevel", "Depth"])


def test_a_connection_for_one_packet_is_enough():
    """imcjava's sendReliably connects, writes one packet, and closes."""

    async def test(script, server, depths):
        for number in range(20):
            request = imcpy.PlanControl()
            request.src, request.dst, request.request_id = CONSOLE, VEHICLE, number
            request.type, request.op = imcpy.PlanControl.TypeEnum.REQUEST, imcpy.PlanControl.OperationEnum.GET
            with socket.create_connection((HOST, server.open_port)) as opened:
                opened.sendall(imcpy.Packet.serialize(request))
        await until(script, lambda: len(depths.heard) == 20)
        assert sorted(m.request_id for m in depths.heard) == list(range(20))
        await until(script, lambda: not server.streams)

    assert not run(test).log


def test_a_connection_for_one_packet_is_enough_while_the_vehicle_talks():
    """Who closes after its packet refuses what the vehicle sends; the packet counts nevertheless."""

    async def test(script, server, depths):
        def talk(left):
            depths.publish(imc.FuelLevel(value=float(left)))
            if left:
                depths.after(0.0002, talk, left - 1)

        for number in range(40):
            talk(20)
            with socket.create_connection((HOST, server.open_port)) as opened:
                opened.sendall(packet(imc.PlanControl(request_id=number)))
            await script.sleep(0.006)
        await until(script, lambda: not server.streams)
        assert [m.request_id for m in depths.heard] == list(range(40))

    assert not run(test, transports=["FuelLevel", "Depth"]).log


def test_packets_may_come_in_pieces_and_between_rubbish():
    async def test(script, server, depths):
        peer = Peer.of(server.open_port)
        beat = packet(imc.Heartbeat())
        for byte in beat:
            peer.send(bytes([byte]))
            await script.sleep(0.001)
        damaged = bytearray(packet(imc.Abort()))
        damaged[15] ^= 1
        peer.send(b"GET / HTTP/1.0\r\n\r\n" + beat + bytes(damaged) + beat + beat[:7])
        await until(script, lambda: len(depths.heard) == 3)
        peer.socket.close()
        await until(script, lambda: not server.streams)
        assert {type(m) for m in depths.heard} == {imc.Heartbeat}
        assert server.drops["malformed"][HOST] >= 1

    assert any("bytes that are no packet" in line for line in run(test).log)


@pytest.mark.heavy
def test_a_damaged_length_makes_the_server_deaf_for_a_moment_only():
    async def test(script, server, depths):
        peer = Peer.of(server.open_port)
        peer.send(bytes.fromhex("54fe050000f0") + packet(imc.Abort()))
        began = time.monotonic()
        await until(script, lambda: depths.heard)
        assert time.monotonic() - began < 2.5
        damaged = bytearray(packet(imc.Heartbeat()))
        damaged[4:6] = (2000).to_bytes(2, "little")
        peer.send(bytes(damaged))
        for _ in range(10):
            peer.send(packet(imc.Heartbeat()))
        await until(script, lambda: len(depths.heard) == 11)
        assert server.drops["malformed"][HOST] == 2

    assert any("bytes that are no packet: truncated" in line for line in run(test).log)


def test_what_claims_to_be_the_vehicle_or_is_not_allowed_is_dropped_and_named():
    async def test(script, server, depths):
        peer = Peer.of(server.open_port)
        peer.send(packet(imc.Abort(), VEHICLE) + packet(imc.Abort(), 0x4009) + packet(imc.Heartbeat(), 0x4009))
        peer.send(packet(imc.Abort(), CONSOLE))
        await until(script, lambda: len(depths.heard) == 2)
        assert {(type(m), m.src) for m in depths.heard} == {(imc.Heartbeat, 0x4009), (imc.Abort, CONSOLE)}

    log = run(test, consoles=["0x4000"]).log
    assert any("0x001A at 127.0.0.1 dropped: sent as this vehicle" in line for line in log)
    assert any("0x4009 at 127.0.0.1 dropped: command of a console that is not listed" in line for line in log)


def test_messages_of_others_are_forwarded_to_others_only_if_the_profile_says_so():
    async def test(script, server, depths):
        one, two = Peer.of(server.open_port), Peer.of(server.open_port)
        two.send(packet(imc.Heartbeat(), 0x4002))
        await until(script, lambda: depths.heard)
        for _ in range(2):
            one.send(packet(imc.Depth(value=-7.0), 0x0801, target=0xFFFF))
        await script.sleep(0.2)
        counts = [sum(m.src == 0x0801 for m in peer.take()) for peer in (one, two)]
        assert counts == ([0, 0] if server.local_messages_only else [0, 1])  # a repeated packet is forwarded once

    run(test)
    run(test, local_messages_only=False)


def test_a_client_that_does_not_read_is_cut_off_and_delays_nobody():
    async def test(script, server, depths):
        slow = socket.socket()
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        slow.connect((HOST, server.open_port))
        good = Peer.of(server.open_port)
        await until(script, lambda: [stream.greeted for stream in server.streams] == [True, True])
        server.streams[0].socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
        big = imc.DevDataText(value="x" * 60_000)
        for _ in range(2 * LONGEST_WAIT // 60_000):
            depths.publish(big)
            await script.sleep(0.005)
            good.take()
        await until(script, lambda: len(server.streams) == 1)
        assert len(good.of_type(imc.DevDataText)) == 2 * LONGEST_WAIT // 60_000
        values = [message.value for message in good.of_type(imc.Depth)]
        assert values == [values[0] + i for i in range(len(values))]
        slow.close()

    assert any("it leaves 1 MiB unread" in line for line in run(test, transports=["Depth", "DevDataText"]).log)


@pytest.mark.heavy
def test_a_peer_that_sends_no_imc_is_cut_off():
    async def test(script, server, depths):
        bad, good = Peer.of(server.open_port), Peer.of(server.open_port)
        try:
            for _ in range(60):
                bad.send(b"T\xfe" * 2048)
                await script.sleep(0.002)
        except OSError:
            pass
        await until(script, lambda: len(server.streams) == 1)
        good.send(packet(imc.Heartbeat()))
        await until(script, lambda: depths.heard)

    assert any("it sends no IMC" in line for line in run(test, maximum_rate=100_000.0).log)


@pytest.mark.heavy
def test_a_flood_takes_its_turn():
    """What is sent too fast waits at its sender; the vehicle's own timers go on."""

    async def test(script, server, depths):
        flood = Peer.of(server.open_port)
        beats, sent = packet(imc.Heartbeat()) * 1000, 0
        began, ticks = time.monotonic(), depths.count
        while time.monotonic() - began < 2.0 or depths.count - ticks < 150:
            try:
                sent += flood.socket.send(beats)
            except BlockingIOError:
                pass
            await script.sleep(0.001)
        took = time.monotonic() - began  # it may be longer on a busy machine
        assert len(depths.heard) < 1250 * took
        assert sent < 4_000_000 * took

    run(test, maximum_rate=500.0)


def test_there_is_room_for_so_many_and_no_more():
    async def test(script, server, depths):
        peers = [Peer.of(server.open_port) for _ in range(5)]
        await until(script, lambda: any(peer.take() is not None and peer.closed for peer in peers))
        assert len(server.streams) == 4
        for peer in peers:
            peer.socket.close()
        await until(script, lambda: not server.streams)
        again = Peer.of(server.open_port)
        await until(script, lambda: again.of_type(imc.Depth))

    assert any("127.0.0.1 was rejected" in line for line in run(test, maximum_connections=4).log)


@pytest.mark.heavy
def test_idle_connections_shut_nobody_out():
    """One that has commanded stays; nor does it help to be busy in many connections from one address."""

    async def test(script, server, depths):
        def connect(address):
            return Peer(socket.create_connection((HOST, server.open_port), source_address=(address, 0)))

        operator = connect(HOST)
        operator.send(packet(imc.Abort()))
        idle = [connect(HOST) for _ in range(3)]
        await until(script, lambda: len(server.streams) == 4 and len(depths.heard) == 1)
        await script.sleep(1.1)
        late = connect(HOST)
        late.send(packet(imc.Abort(), 0x4001))
        await until(script, lambda: len(depths.heard) == 2)
        await until(script, lambda: idle[0].take() is not None and idle[0].closed)
        for peer in (operator, late, *idle[1:]):
            peer.send(packet(imc.Heartbeat()))
        await until(script, lambda: len(depths.heard) == 6)
        connect("127.0.0.2").send(packet(imc.Abort(), 0x4002))
        await until(script, lambda: len(depths.heard) == 7)
        await until(script, lambda: idle[1].take() is not None and idle[1].closed)
        assert not operator.closed

    log = run(test, maximum_connections=4).log
    assert sum("ended: too many are connected" in line for line in log) == 1


def test_a_peer_that_vanishes_is_noticed():
    async def test(script, server, depths):
        peer = Peer.of(server.open_port)
        await until(script, lambda: server.streams)
        opened = server.streams[0].socket
        assert opened.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
        assert opened.getsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPIDLE) == 15
        assert opened.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT) == 30_000
        peer.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        peer.socket.close()  # a reset
        await until(script, lambda: not server.streams)
        assert not server.subscriptions

    run(test)


def test_a_client_of_a_scaled_vehicle_has_its_own_seconds():
    async def test(script, server, depths):
        peer, began = Peer.of(server.open_port), time.monotonic()
        peer.send(packet(imc.Heartbeat()) * 600)
        await until(script, lambda: time.monotonic() > began + 0.5)
        assert 2 <= len(peer.of_type(imc.Depth)) <= 7, "10 Hz"
        assert len(depths.heard) <= 400, "200 at once, and 200 per second"

    run(test, clock=ScaledClock(20.0), rate_limiters=["Depth:10"], maximum_rate=200.0)


def test_a_taken_port_is_left_to_its_owner():
    with socket.socket() as taken:
        taken.bind((HOST, 0))
        taken.listen()
        port = taken.getsockname()[1]
        done = simulate((Server), clock=WallClock(), seconds=0.1, port=port)
    assert port < done.task.open_port <= port + 5
    assert any(f"port {port} is taken" in line for line in done.log)
    done = simulate(Server, clock=WallClock(), seconds=0.1, address="203.0.113.9")
    assert any("cannot listen at 203.0.113.9" in line for line in done.log)


def test_neptus_commands_the_otter_by_tcp(tmp_path):
    """PlanDB, PlanControl and parameters over one connection of a shipped vehicle."""
    profile = load_profile("otter", overrides=["Transports.TCP.Server:Port=0"])
    selected = profile.parse_modes("Simulation")
    others = ("Announce", "Discovery", "UDP", "FTP", "MAVLink")
    only = [
        section.name
        for section in profile.config.sorted_sections()
        if profile.is_task_enabled(section.name, selected)
        and section.name not in [f"Transports.{name}" for name in others]
    ]
    vehicle = build(
        profile, selected, clock=parse_clock("10x", 0), log_root=tmp_path, state_folder=tmp_path, only=only
    ).vehicle
    server = vehicle.task("Transports.TCP.Server")
    answers = []

    async def test(script):
        peer = Peer.of(server.open_port)

        async def ask(request, kind, where=lambda m: True):
            count = len(peer.heard)
            peer.send(packet(request, target=vehicle.system))
            await until(script, lambda: [m for m in peer.take()[count:] if isinstance(m, kind) and where(m)])
            return next(m for m in peer.heard[count:] if isinstance(m, kind) and where(m))

        boot = imc.VehicleState.OpMode.BOOT
        await until(script, lambda: any(state.op_mode != boot for state in peer.of_type(imc.VehicleState)))
        goto = imc.Goto(lat=0.7188, lon=-0.152, speed=1.0, speed_units=0, timeout=100)
        step = imc.PlanManeuver(maneuver_id="1", data=goto)
        plan = imc.PlanSpecification(plan_id="p", start_man_id="1", maneuvers=(step,))
        kind = imc.PlanDB
        answers.append(
            await ask(kind(op=kind.Op.SET, plan_id="p", arg=plan), kind, lambda m: m.type == kind.Type.SUCCESS)
        )
        kind = imc.PlanControl
        answers.append(await ask(kind(op=kind.Op.START, plan_id="p", request_id=5), kind, lambda m: m.request_id == 5))
        answers.append(await ask(imc.QueryEntityParameters(name="GPS"), imc.EntityParameters))
        answers.append(await ask(imc.EntityList(op=imc.EntityList.Op.QUERY), imc.EntityList))
        vehicle.stop()

    vehicle.start()
    vehicle.kernel.soon(vehicle.daemon.start_script, test)
    vehicle.run(300.0)
    vehicle.close()
    assert [type(m).__name__ for m in answers] == ["PlanDB", "PlanControl", "EntityParameters", "EntityList"]
    assert answers[1].type == imc.PlanControl.Type.SUCCESS
