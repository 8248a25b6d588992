"""How long a vehicle is looked for: short on this computer, longer where packets get lost and somebody answers."""

import asyncio
import contextlib
import time

import pytest

from shoal.network import Network, NetworkError, UDPLink
from tests.shoal.network.station import Station, discovery_ports, living

PATIENCE = 0.2  # s; one that comes in LATE does not come in time
LATE = 0.8


async def look(*, far: bool, others: bool) -> str:
    """Look for a station that comes late; returns its name."""
    ports = discovery_ports()
    late = Station(ports[:-1], name="late", system=0x0B02)
    link = UDPLink(ports=ports)
    link.is_far = far  # a loopback address is not, but nothing else differs
    async with contextlib.AsyncExitStack() as stack:
        stack.callback(late.close)
        if others:
            await stack.enter_async_context(living(Station(ports)))
        network = await stack.enter_async_context(Network([link]))

        coming = asyncio.get_running_loop().call_later(LATE, late.announce)
        stack.callback(coming.cancel)
        return (await network.find("late", PATIENCE)).name


def test_over_a_radio_on_which_somebody_answers_a_late_vehicle_is_found() -> None:
    assert asyncio.run(look(far=True, others=True)) == "late"


def test_on_this_computer_who_is_not_there_is_told_soon() -> None:
    began = time.monotonic()
    with pytest.raises(NetworkError, match="no vehicle 'late' on the network"):
        asyncio.run(look(far=False, others=True))
    assert time.monotonic() - began < LATE


def test_where_nobody_answers_the_search_ends_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shoal.network.network.FAR", 2 * PATIENCE)
    with pytest.raises(NetworkError, match="no vehicle is on the network"):
        asyncio.run(look(far=True, others=False))
