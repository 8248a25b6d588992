"""Finding the systems around a shipped vehicle by what they announce, and being found."""

import contextlib
import itertools
import socket
import threading
import time

import pytest

import imc
from imc.discovery import MULTICAST, PORTS, Service, Services
from runtime.kernel import WallClock
from runtime.network_interfaces import Interface
from runtime.testing import simulate
from support.log_limit import AT_ONCE
from tasks.transports import discovery
from tasks.transports.announce import BREAK, MOST_SYSTEMS, Announce
from tasks.transports.discovery import NEW_RATE, NEW_SYSTEMS
from tasks.transports.imc_links import shared_discovery
from tests.tasks.transports.imc_station import Station, afloat, free_ports

OWN = 0x001A
SERVICE = imc.AnnounceService.ServiceType


@pytest.fixture(scope="module")
def vessel(tmp_path_factory):
    with afloat(tmp_path_factory.mktemp("discovery")) as vehicle:
        yield vehicle


def test_an_announce_comes_to_the_bus_once_unchanged_and_the_own_never(vessel):
    heard = vessel.hears(imc.Announce)
    station = Station(vessel, 0x4300, "ccu-once")
    packet = imc.encode(imc.Announce(src=0x4300, src_ent=7, timestamp=1e9, sys_name="ccu-once", services="", lat=0.5))
    for _ in range(3):
        station.send_bytes(packet, vessel.discovery.port)
    station.announce(sys_name="ccu-last")
    vessel.until(lambda: [m for m in heard if m.sys_name == "ccu-last"])
    others = [m for m in heard if m.src != OWN]
    assert [m.sys_name for m in others] == ["ccu-once", "ccu-last"]
    assert imc.encode(others[0]) == packet
    vessel.logged("new system within range: ccu-once (0x4300) at 127.0.0.1")


def test_what_is_no_announce_is_dropped_counted_and_named(vessel):
    station = Station(vessel, 0x4301)
    heard = vessel.hears(imc.VehicleCommand)
    station.send(imc.VehicleCommand(), vessel.discovery.port)
    station.send_bytes(b"rubbish", vessel.discovery.port)
    station.announce(src=0xFFF0)
    vessel.logged("announcement from 127.0.0.1 dropped: no Announce (VehicleCommand)")
    vessel.logged("announcement from 127.0.0.1 dropped: malformed")
    vessel.until(lambda: vessel.discovery.drops["no Announce"]["127.0.0.1"] == 2)
    assert not heard


@pytest.mark.heavy
def test_a_new_system_gets_an_answer_within_a_second_or_two(vessel):
    port = next(port for port in vessel.ports if port != vessel.discovery.port)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", port))
        listener.settimeout(5.0)
        time.sleep(1.3)
        began = time.monotonic()
        Station(vessel, 0x4302, "new").announce()
        announce = imc.decode(listener.recv(65535))
    assert time.monotonic() - began < 2.5
    assert announce.src == OWN
    assert Services.parse(announce.services).endpoints("imc+udp") == (("127.0.0.1", vessel.udp.port),)


@pytest.mark.parametrize("reach", ["this computer", "another computer"])
def test_a_vehicle_on_loopback_answers_this_computer_only(vessel, reach, monkeypatch):
    """Also those of this computer that announce its address in the network; others are heard of over zenoh."""
    task, sent = vessel.vehicle.task("Transports.Announce"), []
    own = [Interface("lo", "127.0.0.1", ""), Interface("eth0", "192.0.2.7", "192.0.2.255")]
    monkeypatch.setattr("tasks.transports.announce.interfaces", lambda: own)
    address = "192.0.2.7" if reach == "this computer" else "203.0.113.9"
    system = 0x4330 + len(reach)

    def send(by, message, places):
        sent.extend((place, message.services) for place in places)
        return set()

    time.sleep(BREAK)  # since the answer to the system of another test
    task.send = send
    try:
        Station(vessel, system).announce(
            str(Services.from_system_info([Service("imc+udp", address, 6001)], uid=system))
        )
        vessel.until(lambda: system in task.systems)
        vessel.hears(imc.Announce)  # the answer comes with that
    finally:
        del task.send
    answers = [services for place, services in sent if place.address != "127.0.0.1"]
    assert len(answers) == (reach == "this computer")
    assert all(f"imc+udp://127.0.0.1:{vessel.udp.port}/" in services for services in answers)


@pytest.mark.parametrize(("kind", "count"), [("LOCAL", 0), ("EXTERNAL", 1)])
def test_who_could_use_no_service_gets_no_answer(kind, count):
    sent = []

    async def meet(script):
        script.task.vehicle.task("Transports.Announce").send = lambda by, message, places: sent.extend(places) or set()
        script.task.publish(imc.AnnounceService(service="ftp://10.0.0.7:21/", service_type=SERVICE[kind]))
        other = Services.from_system_info([Service("imc+udp", "203.0.113.9", 6001)])
        script.task.relay(imc.encode(imc.Announce(src=0x4340, sys_name="far", services=str(other))))
        await script.sleep(0.1)

    simulate(Announce, clock=WallClock(), seconds=0.2, address="0.0.0.0", script=meet)
    assert [place.port for place in sent if place.address == "203.0.113.9"].count(6001) == count


def test_a_thousand_newcomers_are_answered_one_after_the_other_and_each_once():
    sent = []

    def newcomer(system, port):
        services = Services.from_system_info([Service("imc+udp", "203.0.113.9", port)], uid=system)
        message = imc.Announce(
            src=system, sys_name=f"ccu-{system}", sys_type=imc.SystemType.CCU, services=str(services)
        )
        return imc.encode(message)

    async def flood(script):
        def send(by, message, places):
            sent.extend((script.now, place.port) for place in places if place.address == "203.0.113.9")
            return set()

        script.task.vehicle.task("Transports.Announce").send = send
        script.task.publish(imc.AnnounceService(service="ftp://10.0.0.7:21/", service_type=SERVICE["EXTERNAL"]))
        for number in range(1000):
            for port in (6001, 7000 + number):  # it moves while it waits
                script.task.relay(newcomer(0x4400 + number, port))
        await script.sleep(20.0)

    simulate(Announce, seconds=21.0, address="0.0.0.0", enable_broadcast=False, enable_multicast=False, script=flood)
    times, ports = zip(*(row for row in sent if row[1] < min(PORTS)), strict=True)
    assert len(ports) == len(set(ports)) == MOST_SYSTEMS + 1
    assert min(later - earlier for earlier, later in itertools.pairwise(times)) > 0.99 * BREAK


@pytest.mark.heavy
def test_a_service_of_another_task_is_announced_and_a_wrong_one_is_named(vessel):
    task = vessel.vehicle.task("Transports.Announce")
    kind = imc.AnnounceService.ServiceType
    both = kind.LOCAL | kind.EXTERNAL
    for service in ("http://0.0.0.0:8080/dune", "no service", "ftp://127.0.0.1:30021/", "imc+any://acoustic/modem%20a"):
        message = imc.AnnounceService(service=service, service_type=both)
        vessel.vehicle.kernel.post(vessel.udp.publish, message)
    announced = vessel.hears(imc.Announce)
    wanted = {"http://127.0.0.1:8080/dune", "ftp://127.0.0.1:30021/"}
    wanted.add(f"imc+udp://127.0.0.1:{vessel.udp.port}/acoustic/modem%20a")
    vessel.until(lambda: [m for m in announced if m.src == OWN and wanted <= set(m.services.split(";"))])
    vessel.logged("not announced: 'no service' is not a service such as imc+udp://10.0.0.7:6002/")
    assert Service.parse("http://127.0.0.1:8080/dune").path == "/dune"
    assert task.entity.state == imc.EntityState.State.NORMAL


@pytest.mark.heavy
def test_without_a_free_port_a_vehicle_says_so_and_takes_one_that_gets_free(tmp_path):
    (port,) = free_ports(1)
    taken = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    taken.bind(("127.0.0.1", port))
    with taken, afloat(tmp_path, f"Transports.Discovery:Ports={port}", wait=False) as vessel:
        vessel.logged("receives no announcements, so systems have to announce themselves at its UDP port: 127.0.0.1: ")
        vessel.until(lambda: vessel.discovery.entity.state == imc.EntityState.State.FAULT)
        taken.close()
        vessel.until(lambda: vessel.discovery.port == port)
        vessel.until(lambda: vessel.discovery.entity.state == imc.EntityState.State.NORMAL)


def test_vehicles_of_a_computer_share_one_port_and_one_takes_the_place_of_another(tmp_path):
    (port,) = free_ports(1)
    setting = f"Transports.Discovery:Ports={port}"
    with contextlib.ExitStack() as second_stack, contextlib.ExitStack() as first_stack:
        first = first_stack.enter_context(afloat(tmp_path / "first", setting))
        second = second_stack.enter_context(afloat(tmp_path / "second", setting, profile="otter", wait=False))
        second.until(lambda: second.discovery.follower)
        station = Station(first, 0x4310, "ccu-shared")
        station.announce(port=port)
        for vessel in (first, second):
            vessel.logged("new system within range: ccu-shared (0x4310) at 127.0.0.1")
        assert second.discovery.entity.state == imc.EntityState.State.NORMAL
        first_stack.close()
        second.until(lambda: second.discovery.port == port)
        Station(second, 0x4311, "ccu-later").announce()
        second.logged("new system within range: ccu-later (0x4311) at 127.0.0.1")


@pytest.fixture
def quick(monkeypatch):
    """Signs of life five times as often, for what takes seconds; returns a setting with two ports."""
    monkeypatch.setattr(discovery, "PULSE", 0.2)
    return f"Transports.Discovery:Ports={', '.join(map(str, free_ports(2)))}"


def hears(vessel, system):
    """Whether a vehicle hears at the port that it has."""
    vessel.until(lambda: vessel.discovery.port)
    Station(vessel, system, f"ccu-{system:x}").announce()
    vessel.logged(f"new system within range: ccu-{system:x} (0x{system:04X}) at 127.0.0.1")
    vessel.until(lambda: vessel.discovery.entity.state == imc.EntityState.State.NORMAL)


@pytest.mark.heavy
def test_who_follows_a_vehicle_that_hangs_listens_itself(tmp_path, quick):
    hangs, goes_on = threading.Event(), threading.Event()

    def hang():
        hangs.set()
        goes_on.wait(10.0)

    with afloat(tmp_path / "first", quick) as first, afloat(tmp_path / "second", quick, wait=False) as second:
        second.until(lambda: second.discovery.follower and second.discovery.follower.welcome)
        second.until(lambda: second.discovery.follower.silence == 1)
        first.vehicle.kernel.post(hang)
        with afloat(tmp_path / "third", quick, wait=False) as third:
            assert hangs.wait(10.0)
            second.logged("the vehicle that listens for all is silent: listens itself, at port ")
            hears(second, 0x4350)
            third.logged("receives no announcements, so systems have to announce themselves at its UDP port: the")
            goes_on.set()
            third.until(lambda: third.discovery.follower.welcome and not third.discovery.trouble.reason)
            Station(first, 0x4351, "ccu-later").announce()
            third.logged("new system within range: ccu-later (0x4351) at 127.0.0.1")


def test_who_is_refused_by_the_one_that_should_listen_does_it_itself(tmp_path, quick, monkeypatch):
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as idle:
        name = quick.partition("=")[2].replace(" ", "")
        idle.bind(shared_discovery._place(f"127.0.0.1-{MULTICAST}-{name}"))
        with afloat(tmp_path / "alone", quick, wait=False) as vessel:
            vessel.logged("the program that listens for all accepts no more: listens itself, at port ")
            hears(vessel, 0x4352)
    monkeypatch.setattr(shared_discovery, "MOST_FOLLOWERS", 0)
    with afloat(tmp_path / "first", quick) as first, afloat(tmp_path / "second", quick, wait=False) as surplus:
        surplus.logged("the program that listens for all accepts no more: listens itself, at port ")
        assert surplus.discovery.refusals == 2
        hears(surplus, 0x4353)
        hears(first, 0x4354)


def test_a_fleet_of_this_computer_may_announce_itself_at_once(vessel):
    station = Station(vessel, 0x4320)
    before = str(vessel.discovery.drops)
    for system in range(0x4400, 0x4400 + 60):
        station.send_bytes(imc.encode(imc.Announce(src=system, sys_name=f"of-a-fleet-{system}")), vessel.discovery.port)
    vessel.until(lambda: set(range(0x4400, 0x4400 + 60)) <= set(vessel.discovery.seen))
    assert str(vessel.discovery.drops) == before


@pytest.mark.heavy
def test_a_flood_of_new_systems_is_bounded_on_the_bus_and_in_the_log_book(tmp_path):
    with afloat(tmp_path) as vessel:
        seen = vessel.hears(imc.Announce)
        station = Station(vessel, 0x4320)
        for system in range(0x5000, 0x5000 + 600):
            station.send_bytes(imc.encode(imc.Announce(src=system, sys_name=f"s{system}")), vessel.discovery.port)
            time.sleep(0.002)
        vessel.logged("announcements of new systems dropped: too many, the first from 127.0.0.1")
        assert len([other for other in seen if other.src != vessel.vehicle.system]) <= NEW_SYSTEMS + 10 * NEW_RATE
        lines = [text for text in vessel.log if "new system" in text and "dropped" not in text]
        assert len(lines) <= AT_ONCE + 3
        assert "more new systems are within range, which are not logged one by one" in lines
