"""How long a vehicle is looked for: short on this computer, longer where packets get lost and somebody answers."""

import asyncio
import contextlib
import time

import pytest

import imc
from shoal.network import AsyncRemotePlans, Network, NetworkError, UDPLink
from tests.shoal.network.station import Station, discovery_ports, living

PATIENCE = 0.3  # s; one that comes in LATE does not come in time
LATE, TOO_LATE = 0.8, 30.0


@pytest.fixture(autouse=True)
def in_a_hurry(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("NEAR", "FAR"):
        monkeypatch.setattr(f"shoal.network.udp_link.{name}", PATIENCE)


async def look(*, far: bool = False, others: bool = False, silent: bool = False, late_by: float = LATE) -> str:
    """Look for a station that comes late; returns its name. A silent one hears announcements all the time."""
    ports = discovery_ports()
    late = Station(ports if silent else [], name="late", system=0x0B02)
    link = UDPLink(ports=ports)
    link.is_far = far  # a loopback address is not, but nothing else differs
    async with contextlib.AsyncExitStack() as stack:
        stack.callback(late.close)
        if others:
            await stack.enter_async_context(living(Station(ports[:-1])))
        network = await stack.enter_async_context(Network([link]))
        late.ports = ports
        coming = asyncio.get_running_loop().call_later(late_by, late.announce)
        stack.callback(coming.cancel)
        return (await network.find_system("late")).name


@pytest.mark.heavy
def test_over_a_radio_on_which_somebody_answers_a_late_vehicle_is_found() -> None:
    assert asyncio.run(look(far=True, others=True)) == "late"


@pytest.mark.heavy
def test_one_of_this_computer_that_hears_us_is_waited_for() -> None:
    assert asyncio.run(look(silent=True)) == "late"
    assert asyncio.run(look(silent=True, others=True)) == "late"


@pytest.mark.parametrize(
    ("how", "reason"),
    [
        ({"others": True}, "no vehicle 'late' on the network; known: station"),
        ({}, "no vehicle is on the network"),
        ({"far": True}, "no vehicle is on the network"),
    ],
)
def test_where_nobody_else_is_the_search_ends_soon(how: dict[str, bool], reason: str) -> None:
    with pytest.raises(NetworkError, match=reason):
        asyncio.run(look(**how, late_by=TOO_LATE))


@pytest.mark.heavy
def test_a_system_of_dune_announces_itself_late_and_sends_5_s_after_it_has_heard_us() -> None:
    async def act() -> imc.PlanControlState:
        ports = discovery_ports()
        station = Station(ports, version="2026.01.0")
        state = station.packet(imc.PlanControlState(plan_id="survey"))

        async def live() -> None:
            begin = time.monotonic() + 2.0
            while not station.consoles or time.monotonic() < begin:
                station.listen()
                await asyncio.sleep(0.1)
            station.announce()
            await asyncio.sleep(5.0)
            while True:
                station.send(state)
                await asyncio.sleep(0.1)

        async with Network([UDPLink(ports=ports)]) as network:
            living = asyncio.create_task(live())
            try:
                return await AsyncRemotePlans(network, await network.find_system("station")).status()
            finally:
                living.cancel()
                station.close()

    assert asyncio.run(act()).plan_id == "survey"
