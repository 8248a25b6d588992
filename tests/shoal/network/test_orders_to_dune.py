"""Orders to a DUNE vehicle, which carries out each copy: one is sent, once it is known to arrive.

The stand-in follows what was seen of DUNE f8080c0f (Transports.UDP): it announces a version of its own, takes packets
as soon as it has our Announce, and sends nothing until the next of its refreshes, 5 s apart.
"""

import asyncio
import contextlib
import time
from collections import Counter
from collections.abc import Awaitable, Callable

import pytest

import imc
from shoal.network import (
    AsyncRemotePlans,
    AsyncRemoteVehicle,
    ConsoleIdentity,
    Network,
    NetworkError,
    NetworkSystem,
    NoAnswer,
    UDPLink,
    VehicleLost,
    diagnose,
)
from tests.shoal.network.station import Station, discovery_ports, living

DUNE = "2026.01.0"


@pytest.fixture(autouse=True)
def in_a_hurry(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shoal.network.system_table.PATIENCE", 1.5)
    monkeypatch.setattr("shoal.network.system_table.CONTACT", 1.5)
    monkeypatch.setattr("shoal.network.search_report.LONGEST", 0.5)
    monkeypatch.setattr("shoal.network.search_report.EXPLAINED", 0.2)
    monkeypatch.setattr("shoal.network.network.ABORT_REPEAT", 0.6)


def received_while(act: Callable[[Network, NetworkSystem], Awaitable[object]], version: str = DUNE) -> Counter[type]:
    """How many messages of each type a station gets that sends data and answers nothing, until NoAnswer."""

    async def run() -> Counter[type]:
        ports = discovery_ports()
        station = Station(ports, version=version)
        async with living(station), Network([UDPLink(ports=ports)]) as network:
            system = await network.find_system("station")
            with pytest.raises(NoAnswer) as raised:
                await act(network, system)
            assert ("sent once" in str(raised.value)) == (version == DUNE and "Abort" not in str(raised.value))
            await asyncio.sleep(0.2)
            return Counter(type(message) for message in station.heard)

    return asyncio.run(run())


async def start(network: Network, system: NetworkSystem) -> None:
    await AsyncRemotePlans(network, system).start("survey")


async def put(network: Network, system: NetworkSystem) -> None:
    await AsyncRemotePlans(network, system).put(imc.PlanSpecification(plan_id="survey"))


async def change(network: Network, system: NetworkSystem) -> None:
    await AsyncRemoteVehicle(network, system).request(imc.SetEntityParameters(name="GPS"), imc.EntityParameters)


async def abort(network: Network, system: NetworkSystem) -> None:
    await AsyncRemoteVehicle(network, system).abort()


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("order", "kind"), [(start, imc.PlanControl), (put, imc.PlanDB), (change, imc.SetEntityParameters)]
)
def test_an_order_that_is_not_answered_was_sent_once(
    order: Callable[[Network, NetworkSystem], Awaitable[None]], kind: type[imc.Message]
) -> None:
    assert received_while(order)[kind] == 1


@pytest.mark.heavy
def test_a_shoal_vehicle_gets_copies_which_it_knows() -> None:
    assert received_while(start, "shoal")[imc.PlanControl] > 2


@pytest.mark.heavy
def test_a_question_is_repeated() -> None:
    async def ask(network: Network, system: NetworkSystem) -> None:
        request = imc.QueryEntityParameters(name="GPS")
        with contextlib.suppress(NoAnswer):
            await AsyncRemoteVehicle(network, system).request(request, imc.EntityParameters)
        await start(network, system)

    assert received_while(ask)[imc.QueryEntityParameters] > 2


@pytest.mark.heavy
def test_an_abort_is_repeated_but_not_so_often_that_it_overtakes_its_confirmation() -> None:
    assert received_while(abort)[imc.Abort] == 3  # at 0, 0.6 and 1.2 s


async def find_late(first_data: float | None) -> tuple[str, list[str], Station]:
    """Find a station that announces itself at once and sends data later, or never; what was reported meanwhile."""
    ports = discovery_ports()
    station, reported = Station(ports, version=DUNE), list[str]()
    async with contextlib.AsyncExitStack() as stack:
        await stack.enter_async_context(living(station, beats=False))
        network = await stack.enter_async_context(Network([UDPLink(ports=ports)], report=reported.append))

        def send_data() -> None:
            station.send(station.packet(imc.Heartbeat()))

        if first_data is not None:
            asyncio.get_running_loop().call_later(first_data, send_data)
        return (await network.find_system("station")).name, reported, station


def test_a_vehicle_that_has_only_announced_itself_is_waited_for_until_its_first_data() -> None:
    began = time.monotonic()
    name, reported, _ = asyncio.run(find_late(0.7))
    assert name == "station"
    assert time.monotonic() - began > 0.7
    assert reported == ["station has announced itself; a DUNE vehicle sends data within 20 s"]


def test_a_vehicle_that_has_restarted_is_waited_for_again() -> None:
    async def restart() -> tuple[bool, bool]:
        ports = discovery_ports()
        async with Network([UDPLink(ports=ports)]) as network:
            async with living(Station(ports, version=DUNE)):
                system = await network.find_system("station")
                before = system.awaits_contact
            async with living(Station(ports, version=DUNE), beats=False):
                while not system.awaits_contact:
                    await asyncio.sleep(0.02)
                return before, True

    assert asyncio.run(asyncio.wait_for(restart(), 20.0)) == (False, True)


@pytest.mark.heavy
def test_an_order_says_that_a_vehicle_is_waited_for_and_ends_when_it_falls_silent(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("shoal.network.system_table.PATIENCE", 60.0)

    async def fall_silent() -> str:
        ports = discovery_ports()
        async with Network([UDPLink(ports=ports)]) as network:
            async with living(Station(ports, version=DUNE)):
                system = await network.find_system("station")
            with pytest.raises(VehicleLost) as raised:
                await start(network, system)
            return str(raised.value)

    assert "station is" in asyncio.run(asyncio.wait_for(fall_silent(), 20.0))


@pytest.mark.heavy
def test_one_that_never_sends_data_is_not_commanded() -> None:
    with pytest.raises(NetworkError, match="station has announced itself, but sent nothing yet"):
        asyncio.run(find_late(None))


@pytest.mark.heavy
def test_the_doctor_waits_for_the_first_data_before_it_blames_a_firewall() -> None:
    async def examine(first_data: float | None) -> list[str]:
        ports = discovery_ports()
        station = Station(ports, version=DUNE)

        async def send_data() -> None:
            await asyncio.sleep(1e9 if first_data is None else first_data)
            while True:
                station.send(station.packet(imc.Heartbeat()))
                await asyncio.sleep(0.1)

        async with living(station, beats=False), Network([UDPLink(ports=ports)]) as network:
            sending = asyncio.create_task(send_data())
            try:
                found = await diagnose(network, seconds=0.3, patience=0.1)
            finally:
                sending.cancel()
            return [finding.text for finding in found.findings]

    assert "nothing arrives from the vehicle" not in " ".join(asyncio.run(examine(1.0)))
    assert "announces itself, but sends nothing to us" in " ".join(asyncio.run(examine(None)))


def test_a_console_with_an_id_of_its_own_takes_packets_at_the_same_port_each_time() -> None:
    async def ports_of(number: int) -> list[tuple[str, int]]:
        discovery = discovery_ports()
        seen: list[tuple[str, int]] = []
        for _ in range(2):
            station = Station(discovery)
            async with living(station), Network([UDPLink(ports=discovery)], ConsoleIdentity(number, "ccu")) as network:
                await network.find_system("station")
            seen += station.consoles
        return seen

    first, second = asyncio.run(ports_of(0x4107))
    assert first == second
