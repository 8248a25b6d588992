"""The link doctor: each way not to hear each other is named, with what to do."""

import asyncio
import contextlib
import socket
import time
from types import SimpleNamespace

import pytest

import imc
from imc.discovery import Endpoint
from runtime.network_interfaces import Interface
from shoal.network import ConsoleIdentity, Diagnosis, Network, NetworkError, UDPLink, VehicleLost, diagnose
from tests.outside import slowness
from tests.shoal.network.station import OWN, Station, discovery_ports, living

LISTEN = 0.5
STATE = imc.EstimatedState(depth=2.0)


def examine(*, also=lambda station: (), twin=False, **how):
    """The diagnosis of a network with one station."""

    async def act() -> Diagnosis:
        ports = discovery_ports()
        station = Station(ports)
        async with contextlib.AsyncExitStack() as stack:
            if twin:
                await stack.enter_async_context(living(Station(ports[:-1])))
            await stack.enter_async_context(living(station, also=also(station), **how))
            async with Network([UDPLink(ports=ports)]) as network:
                return await diagnose(network, seconds=LISTEN, patience=0.2)

    return asyncio.run(act())


def texts(diagnosis):
    return [f"{finding.about}: {finding.text}" for finding in diagnosis.findings]


@pytest.mark.heavy
def test_a_system_that_is_received_but_does_not_hear_us():
    found = examine()
    assert texts(found) == ["station: is received, but does not answer: nothing arrives from here"]
    (contact,) = found.contacts
    assert (contact.name, contact.id, contact.answered) == ("station", OWN, 0)
    assert contact.rates["udp"] > 2.0
    assert found.links == {"udp": ""}


@pytest.mark.heavy
def test_the_log_book_of_a_vehicle_says_why_it_does_not_hear_us():
    async def act() -> Diagnosis:
        ports = discovery_ports()
        station = Station(ports, complaint="packet from 0x{:04X} dropped: command of a console that is not listed")
        async with living(station), Network([UDPLink(ports=ports)]) as network:
            return await diagnose(network, seconds=LISTEN, patience=0.2)

    silent, why = texts(asyncio.run(act()))
    assert "nothing arrives from here" in silent
    assert why.startswith("station: log book there reports on us: packet from 0x")
    assert why.endswith("dropped: command of a console that is not listed")


@pytest.mark.heavy
def test_a_vehicle_that_writes_its_log_book_all_the_time_is_not_listened_to_for_ever():
    silent = examine(also=lambda station: [station.packet(imc.LogBookEntry(text="GPS fix"))])
    assert texts(silent) == ["station: is received, but does not answer: nothing arrives from here"]


@pytest.mark.heavy
def test_a_system_that_only_announces_itself():
    found = examine(beats=False)
    assert texts(found) == ["station: announces itself, but sends nothing to us: nothing arrives from the vehicle"]
    assert found.contacts[0].rates == {"udp": 0.0}


@pytest.mark.heavy
def test_another_console_that_greets_us_before_its_announce_is_nothing_wrong():
    def greeting(station):
        return [imc.encode_with_header(imc.Heartbeat(), time.time(), 0x4001, 0, 0xFFFF, 0xFF)]

    assert texts(examine(announces=False, beats=False, also=greeting)) == [": no vehicle is received"]


@pytest.mark.heavy
def test_what_the_entities_of_a_vehicle_report_is_reported():
    def states(station):
        fault = imc.EntityState(state=imc.EntityState.State.FAULT, description="id 0x0B01 is also used by evil")
        return [station.packet(imc.EntityInfo(label="Service Discovery")), station.packet(fault)]

    assert texts(examine(also=states))[1:] == ["station: Service Discovery is not well: id 0x0B01 is also used by evil"]


@pytest.mark.heavy
def test_a_system_that_does_not_announce_itself():
    found = examine(announces=False)
    assert any(text.endswith("packets: not announced") and "0x0B01 at 127.0.0.1" in text for text in texts(found))
    assert any("30100-30104" in finding.remedy for finding in found.findings)


@pytest.mark.heavy
def test_packets_that_cannot_be_read():
    def spoiled(station):
        good = station.packet(STATE)
        short = station.packet(imc.Unknown(id=imc.EstimatedState.ID, payload=b"abc"))
        strange = station.packet(imc.Unknown(id=65000, payload=b"abc"))
        web = b"GET / HTTP/1.1 and more of it, to be long enough"
        long = station.packet(imc.EstimatedState(depth=1.0, surplus=b"more"))
        return good[:-1] + bytes([good[-1] ^ 1]), good[:40], short, strange, web, long

    found = examine(also=spoiled)
    reasons = {text.partition("packets: ")[2] for text in texts(found)}
    assert reasons - {""} == {
        "wrong CRC",
        "truncated",
        "schema mismatch: EstimatedState",
        "unknown message id 65000",
        "synchronization number",
        "schema mismatch: EstimatedState is longer than ours",
    }
    assert not [finding for finding in found.findings if finding.remedy == "see docs/running-vehicle.md"]


@pytest.mark.heavy
def test_clocks_that_are_apart():
    async def act() -> Diagnosis:
        ports = discovery_ports()
        async with living(Station(ports, clock=-100.0)), Network([UDPLink(ports=ports)]) as network:
            return await diagnose(network, seconds=LISTEN, patience=0.2)

    clock = next(text for text in texts(asyncio.run(act())) if "clock" in text)
    assert clock.startswith("station: its clock is 100.") or clock.startswith("station: its clock is 99.")
    assert clock.endswith("s behind ours")


@pytest.mark.heavy
def test_two_systems_of_one_name_are_not_commanded():
    assert any("several vehicles have this name and id" in text for text in texts(examine(twin=True)))

    async def act() -> None:
        ports = discovery_ports()
        first, second = Station(ports), Station(ports[:-1], system=OWN + 1)
        async with living(first), living(second), Network([UDPLink(ports=ports)]) as network:
            await asyncio.sleep(0.3)
            with pytest.raises(NetworkError, match="several vehicles have this name, with the ids 0x0B01, 0x0B02"):
                await network.find_system("station")

    asyncio.run(act())


def test_two_systems_of_one_id_are_not_commanded():
    async def act() -> None:
        ports = discovery_ports()
        first, second = Station(ports), Station(ports[:-1], name="other")
        async with living(first), living(second), Network([UDPLink(ports=ports)]) as network:
            await asyncio.sleep(0.3)
            for name, rival in (("station", "other"), ("other", "station")):
                with pytest.raises(NetworkError, match=f"{name}: its id 0x0B01 is also that of {rival} at 127.0.0.1"):
                    await network.find_system(name)

    asyncio.run(act())


def test_two_that_have_only_announced_themselves_are_not_commanded(monkeypatch):
    """Two vehicles with one name and id answer our first Announce at the same moment, before either sends anything.

    That it took long to open the network does not count.
    """
    late = [0.0]
    clock = SimpleNamespace(monotonic=lambda: time.monotonic() + late[0], time=time.time)
    monkeypatch.setattr("shoal.network.network.time", clock)
    monkeypatch.setattr("shoal.network.network.COMPANY", 5.0)

    async def act() -> None:
        ports = discovery_ports()
        first, second = Station(ports), Station(ports[:-1])
        made = Network([UDPLink(ports=ports)])
        late[0] += 10.0
        async with made as network:
            first.announce()
            seeking = asyncio.create_task(network.find_system("station"))
            await asyncio.sleep(0.02)
            second.announce()
            with pytest.raises(NetworkError, match="several vehicles have this name and id"):
                await seeking
            first.listen()  # it greets who greets it, as a vehicle does
            first.send(first.packet(imc.Heartbeat()))
            second.close()
            deadline = time.monotonic() + 5.0
            while network.systems["station"].conflict_text:
                assert time.monotonic() < deadline
                await asyncio.sleep(0.05)
        first.close()

    asyncio.run(act())


def test_a_network_whose_address_has_gone_does_not_end_our_announcements(monkeypatch):
    gone = Interface("radio0", "192.0.2.1", "")
    monkeypatch.setattr("shoal.network.udp_link.interfaces", lambda: [gone])
    monkeypatch.setattr("shoal.network.udp_link.BROADCAST", "127.0.0.1")  # and no other computer

    async def act() -> None:
        ports = discovery_ports()
        async with living(Station(ports)), Network([UDPLink([Endpoint("0.0.0.0", 0)], ports)]) as network:
            assert (await network.find_system("station", 5.0)).id == OWN
            async with asyncio.timeout(5.0):
                while "udp" not in network.systems["station"].last:
                    await asyncio.sleep(0.02)

    asyncio.run(act())


@pytest.mark.heavy
def test_two_programs_with_one_id_are_reported_of():
    async def act() -> None:
        ports = discovery_ports()
        one, other = (ConsoleIdentity.of_this_program(0x4101) for _ in range(2))
        older, newer = UDPLink(ports=ports), UDPLink(ports=ports)
        async with Network([older], one) as network, Network([newer], other), asyncio.timeout(20.0):
            async with living(Station(ports)):
                system = await network.find_system("station")
                while not older.trouble:
                    await asyncio.sleep(0.02)
                assert older.trouble == (
                    "another program at 127.0.0.1 uses the id 0x4101: "
                    "give each program its own (SHOAL_CONSOLE), and list all in Consoles"
                )
                network.expects_all = True
                found = (await diagnose(network, seconds=0.1, patience=0.1)).findings
                taken = [finding for finding in found if "another program" in finding.text]
                assert [finding.text.partition("another program ")[2][:4] for finding in taken] == ["at 1", "uses"]
                assert {finding.remedy[:32] for finding in taken} == {"give each program its own (SHOAL"}
            while system.is_there:
                await asyncio.sleep(0.02)
            with pytest.raises(VehicleLost, match=r"station is gone; .* \(another program at .* uses the id 0x4101: "):
                network.check_is_there(system)

    asyncio.run(act())


@pytest.mark.heavy
def test_no_port_to_hear_announcements():
    async def act() -> Diagnosis:
        ports = discovery_ports()
        with contextlib.ExitStack() as stack:
            for port in ports:
                stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)).bind(("127.0.0.1", port))
            async with Network([UDPLink(ports=ports)]) as network:
                return await diagnose(network, seconds=0.1)

    assert any("all ports of discovery are taken" in text for text in texts(asyncio.run(act())))


def test_a_system_that_ends_is_gone_within_a_second():
    async def act() -> None:
        ports = discovery_ports()
        async with Network([UDPLink(ports=ports)]) as network:
            async with living(Station(ports)):
                await network.find_system("station")
                assert [system.name for system in network.vehicles()] == ["station"]
            began = time.monotonic()
            while network.vehicles():
                await asyncio.sleep(0.02)
                assert time.monotonic() - began < 1.0 * slowness()
            with pytest.raises(VehicleLost, match="station is gone; it has ended"):
                network.check_is_there(network.systems["station"])
            with pytest.raises(NetworkError, match="no vehicle is on the network"):
                await network.find_system("station", 0.1)

    asyncio.run(act())


@pytest.mark.heavy
def test_a_system_that_falls_silent_is_not_said_to_have_ended(monkeypatch):
    """Its process may have been stopped, or the way to it been cut."""
    monkeypatch.setattr("shoal.network.udp_link.SILENCE", 0.5)

    async def act() -> None:
        ports = discovery_ports()
        station = Station(ports)
        task = asyncio.create_task(station.live(announces=True, beats=True))
        async with Network([UDPLink(ports=ports)]) as network:
            system = await network.find_system("station")
            await asyncio.sleep(0.5)
            task.cancel()
            silent = time.monotonic()
            async with asyncio.timeout(20.0):
                while system.is_there:
                    await asyncio.sleep(0.02)
            with pytest.raises(VehicleLost, match=r"station is not received any more, for \d+ s"):
                network.check_is_there(system)
            assert system.age == pytest.approx(time.monotonic() - silent, abs=0.3 * slowness())
        station.close()

    asyncio.run(act())


def test_without_zenoh_and_without_anybody(monkeypatch):
    from shoal.network import ZenohLink

    monkeypatch.setitem(__import__("sys").modules, "zenoh", None)

    async def act() -> None:
        async with Network([ZenohLink()]) as network:
            with pytest.raises(NetworkError, match=r"zenoh is not installed: pip install 'shoal\[zenoh\]'"):
                await network.find_system("station", 0.1)

    asyncio.run(act())
