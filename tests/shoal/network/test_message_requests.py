"""Messages of a time before: which of them a console forgets when it asks for them again."""

import asyncio

import pytest

import imc
from shoal.network import Network
from tests.shoal.console.foxglove.packet_radio import Radio

NAME = "lauv-noptilus-1"


class EndingRadio(Radio):
    """A link that brings what is asked for, or everything as a log does."""

    def __init__(self, *, ends: bool) -> None:
        self._ends = ends

    def unsubscribe(self, system: str, messages: object) -> bool:
        return self._ends


@pytest.fixture(autouse=True)
def no_linger(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shoal.network.message_requests.LINGER", 0.0)


def is_kept(
    first: tuple[type[imc.Message], ...], *, is_for_all: bool, ends: bool = True, covered: bool = False
) -> bool:
    """Whether a Temperature is still known after the use of some types has ended and a plot of it begins."""

    async def run() -> bool:
        radio = EndingRadio(ends=ends)
        async with Network([radio]) as network:
            radio.bring(imc.Heartbeat(src=0x1A))
            system = network.systems[NAME]
            if covered:
                network.subscribe(None, (imc.Temperature,))
            with network.subscribe(None if is_for_all else system, first):
                radio.bring(imc.Temperature(src=0x1A, value=4.0))
            await asyncio.sleep(0.01)
            with network.subscribe(system, (imc.Temperature,)):
                return system.latest_message(imc.Temperature) is not None

    return asyncio.run(run())


@pytest.mark.parametrize("is_for_all", [False, True])
@pytest.mark.parametrize("first", [(), (imc.Temperature,)], ids=["everything", "one"])
def test_what_was_received_before_the_end_is_forgotten(first: tuple[type[imc.Message], ...], is_for_all: bool) -> None:
    assert not is_kept(first, is_for_all=is_for_all)
    assert is_kept(first, is_for_all=is_for_all, covered=True)


@pytest.mark.parametrize("first", [(), (imc.Temperature,)], ids=["everything", "one"])
def test_a_link_that_brings_it_nevertheless_keeps_it(first: tuple[type[imc.Message], ...]) -> None:
    assert is_kept(first, is_for_all=False, ends=False)
