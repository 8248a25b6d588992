"""Links of every scheme on real sockets and lines: who connects, vanishes, does not read, or sends rubbish."""

import os
import socket
import struct

import pytest

from runtime import State
from runtime.kernel import ScaledClock, WallClock
from tests.outside import REFUSED, free_port
from tests.tasks.transports.mavlink_station import (
    FAST,
    HOST,
    Station,
    TcpStation,
    greet,
    mavlink,
    sail,
    told,
    until,
)


def in_a_row(numbers):
    return [(numbers[0] + place) % 256 for place in range(len(numbers))] == numbers


@pytest.mark.heavy
def test_ipv6():
    async def script(control):
        called, calling = Station(control, port=out, host="::1"), Station(control, host="::1")
        await called.expect("HEARTBEAT")
        await greet(called)
        calling.vehicle = ("::1", in_)
        await greet(calling)
        bare = TcpStation(control, ("::1", tcp))
        await bare.expect("HEARTBEAT")
        await greet(bare)

    out, in_, tcp = free_port(), free_port(), free_port("::1")
    run = sail(script, f"udpout://[::1]:{out}", f"udpin://[::1]:{in_}", f"tcpin://[::1]:{tcp}", clock=ScaledClock(FAST))
    assert told(run) == []


def test_broadcast_until_somebody_answers():
    async def script(control):
        everybody = Station(control, port, host="127.255.255.255")
        one = Station(control)
        await everybody.expect("HEARTBEAT")
        one.vehicle = (HOST, everybody.vehicle[1])
        await one.meet(one.vehicle)
        await greet(one)
        everybody.take()
        everybody.inbox.clear()
        await one.quiet(5.0)
        assert everybody.take() == [], "two counts of sequence numbers would look like lost frames"
        assert in_a_row(one.sequence)
        await everybody.expect("HEARTBEAT", seconds=40.0)

    port = free_port()
    run = sail(script, f"udpbcast://127.255.255.255:{port}")
    assert told(run) == []


def test_the_address_of_a_station_is_looked_up_and_followed(monkeypatch):
    places = {}

    def look_up(host):
        assert host == "station.local"
        return places.get(host) or OSError(f"{host}: Name or service not known")

    async def script(control):
        await control.sleep(3.0)
        entity = mavlink(control).entity
        assert entity.state is State.ERROR
        assert f"udpout://station.local:{port}: station.local: Name or service not known" in entity.description
        for address in (HOST, "127.0.0.2"):
            places["station.local"] = address
            station = Station(control, port, host=address)
            await station.expect("HEARTBEAT", seconds=70.0)  # the station before is forgotten after 30 s
            await greet(station)
            station.socket.close()
        assert entity.state is State.NORMAL

    monkeypatch.setattr("tasks.transports.mavlink_links.udp_links.resolve_host", look_up)
    port = free_port()
    run = sail(script, f"udpout://station.local:{port}", seconds=200.0)
    assert [line.partition("station.local: ")[2] for line in run.log if "known" in line] == [
        "Name or service not known"
    ]


def test_a_full_link_lets_go_who_has_been_silent_longest():
    async def script(control):
        first, second, third = (Station(control, system=system) for system in (255, 254, 253))
        for station in (first, second):
            await station.meet((HOST, port))
        third.vehicle = (HOST, port)
        for _ in range(10):
            second.send("HEARTBEAT", type=6)
            third.send("HEARTBEAT", type=6)
            await control.sleep(1.0)
        await third.expect("HEARTBEAT")
        link = mavlink(control).link_set.links[0]
        assert [peer[1] for peer in link.sessions] == [second.port, third.port]
        assert 3 <= link.counts["rejected"] <= 6, "nobody has to go who was heard in the last 5 s"

    port = free_port()
    run = sail(script, f"udpin://{HOST}:{port}", maximum_peers=2)
    (line,) = told(run)
    assert line == f"udpin://{HOST}:{port} has its 2 stations: {HOST} was rejected"


def test_who_only_listens_gets_the_default_rates():
    async def script(control):
        await control.sleep(40.0)
        udp.take()
        udp.inbox.clear()
        for _ in range(20):
            await control.sleep(1.0)
            udp.take()
        names = [message.name for message in udp.inbox]
        assert 9 <= names.count("CURRENT_MODE") <= 11
        assert 19 <= names.count("HEARTBEAT") <= 21

    udp = Station(None)
    sail(script, f"udpout://{HOST}:{udp.port}")


def test_stations_connect_by_tcp():
    async def script(control):
        task = mavlink(control)
        silent, other = TcpStation(control, (HOST, port)), TcpStation(control, (HOST, port), system=254)
        await silent.expect("HEARTBEAT")
        await greet(other)
        assert len(task.link_set.links[0].sessions) == 2
        silent.order(511, 30, 20_000)
        other.transmit(b"".join(other.frame("COMMAND_LONG", target_system=26, command=400, param1=1) for _ in range(3)))
        for _ in range(3):
            assert (await other.expect("COMMAND_ACK"))["command"] == 400
        silent.take()
        assert in_a_row(silent.sequence)
        assert in_a_row(other.sequence)
        silent.socket.close()
        await until(control, lambda: len(task.link_set.links[0].sessions) == 1)
        for byte in other.frame("COMMAND_LONG", target_system=26, target_component=1, command=519):
            other.transmit(bytes((byte,)))
            await control.sleep(0.002)
        assert (await other.expect("COMMAND_ACK"))["command"] == 519
        assert task.entity.state is State.NORMAL

    port = free_port()
    run = sail(script, f"tcpin://{HOST}:{port}?flavor=px4", clock=ScaledClock(FAST))
    assert told(run) == []


def test_a_stranger_that_connects_a_hundred_times_takes_nobodys_place():
    async def script(control):
        station = TcpStation(control, (HOST, port))
        await greet(station)
        strangers = [socket.create_connection((HOST, port)) for _ in range(100)]
        link = mavlink(control).link_set.links[0]
        await until(control, lambda: link.counts["rejected"] == 97)
        await greet(station)
        assert len(link.sessions) == 4
        for stranger in strangers:
            stranger.close()
        await until(control, lambda: len(link.sessions) == 1)
        await until(control, lambda: "rejected 97" in mavlink(control).entity.description)
        await greet(TcpStation(control, (HOST, port), system=254))

    port = free_port()
    run = sail(script, f"tcpin://{HOST}:{port}", maximum_peers=4, clock=ScaledClock(FAST))
    assert told(run) == [f"tcpin://{HOST}:{port} has its 4 stations: {HOST} was rejected"]


def test_a_connection_that_carries_no_mavlink_is_ended():
    async def script(control):
        good = TcpStation(control, (HOST, port))
        await greet(good)
        for _ in range(2):
            bad = TcpStation(control, (HOST, port))
            for _ in range(40):
                bad.socket.setblocking(True)
                try:
                    bad.transmit(os.urandom(4096))
                except OSError:
                    break
                finally:
                    bad.socket.setblocking(False)
                await control.sleep(0.01)
            bad.take()
            await until(control, lambda bad=bad: bad.take() is not None and bad.ended)
        await greet(good)
        assert mavlink(control).link_set.links[0].counts["cut off"] == 2

    port = free_port()
    run = sail(script, f"tcpin://{HOST}:{port}", clock=ScaledClock(FAST))
    (line,) = [line for line in told(run) if "frames dropped" not in line]
    assert line == f"tcpin://{HOST}:{port} has ended a connection with {HOST}, which sends no MAVLink"


def test_a_station_that_does_not_read_gets_what_is_new_and_holds_up_nobody():
    async def script(control):
        slow, good = TcpStation(control, (HOST, port), room=4096), TcpStation(control, (HOST, port), system=254)
        await good.expect("HEARTBEAT")
        link = mavlink(control).link_set.links[0]
        session = next(session for peer, session in link.sessions.items() if peer == slow.socket.getsockname())
        began = control.now
        for number in range(6000):
            session.build_and_send("SYSTEM_TIME", control.now)
            if number % 500 == 0:
                session.build_and_send("PROTOCOL_VERSION", control.now)
                await control.sleep(0.02)
        assert link.counts["unsent"] > 1000
        good.take()
        beats = sum(message.name == "HEARTBEAT" for message in good.inbox)
        assert beats >= control.now - began - 1.0
        last = control.now
        await until(control, lambda: any(m.values["time_unix_usec"] >= last * 1e6 - 1 for m in times(slow)))
        assert slow.damages == 0, "no frame is sent in part"
        assert sum(message.name == "PROTOCOL_VERSION" for message in slow.inbox) == 12, "answers do not come again"
        await greet(slow)

    def times(station):
        return [message for message in station.take() if message.name == "SYSTEM_TIME"]

    port = free_port()
    run = sail(script, f"tcpin://{HOST}:{port}", clock=ScaledClock(FAST))
    assert told(run) == []


def test_a_connection_that_ends_while_it_is_answered_ends_nothing_else():
    async def script(control):
        good = TcpStation(control, (HOST, port), system=254)
        await greet(good)
        for _ in range(5):
            station = TcpStation(control, (HOST, port))
            await greet(station)
            station.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            station.transmit(b"".join(station.frame("COMMAND_LONG", command=519) for _ in range(20)))
            station.socket.close()  # by a reset: the answers find nobody
            for session in mavlink(control).endpoint.sessions:
                for _ in range(3):
                    session.build_and_send("SYSTEM_TIME", control.now)
            mavlink(control).send_due_messages()
        await until(control, lambda: len(mavlink(control).endpoint.sessions) == 1)
        await greet(good)
        assert mavlink(control).link_set.drop_counts["rejected"] == 0

    port = free_port()
    run = sail(script, f"tcpin://{HOST}:{port}", clock=WallClock())
    assert told(run) == []


def test_a_tcp_server_comes_late_goes_and_comes_back():
    async def script(control):
        task = mavlink(control)
        await until(control, lambda: task.entity.state is State.ERROR)
        for _ in range(2):
            with socket.create_server((HOST, port)) as server:
                server.setblocking(False)
                await until(control, lambda: task.link_set.links[0].sessions)
                opened, _ = server.accept()
                station = TcpStation(control, opened)
                await greet(station)
            station.socket.close()
            await until(control, lambda: not task.link_set.links[0].sessions)
            await until(control, lambda: task.entity.state is State.ERROR)

    port = free_port()
    run = sail(script, f"tcpout://localhost:{port}", clock=ScaledClock(FAST))
    refused = [line for line in run.log if REFUSED in line]
    assert refused[0] == f"tcpout://localhost:{port}: {REFUSED}"
    assert len(refused) == 1
