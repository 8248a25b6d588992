"""Who has aborted is named as the network knows him."""

import asyncio

import pytest

import imc
from shoal.console.abort_senders import AbortSenders
from shoal.network import Network
from tests.shoal.console.foxglove.packet_radio import Radio

NAME = "lauv-noptilus-1"


@pytest.mark.parametrize(
    ("reported", "shown"),
    [
        ("0x5B74 - 23412 @ 0", "system 0x5B74"),
        ("0x4100 - 16640 @ 7", "ccu-anna (0x4100)"),
        ("manta-1 - 16641 @ Bridge", "Bridge of manta-1 (0x4101)"),
        ("0x001A - 26 @ MAVLink", f"MAVLink of {NAME} (0x001A)"),
        ("own", "anna on this page"),
    ],
)
def test_an_abort_has_the_name_of_its_sender(reported: str, shown: str) -> None:
    async def run() -> str:
        radio = Radio()
        async with Network([radio]) as network:
            radio.bring(imc.Heartbeat(src=0x1A))
            radio.bring(imc.Announce(src=0x4100, sys_name="ccu-anna"), system="ccu-anna")
            number = network.console.id
            words = f"0x{number:04X} - {number} @ 0" if reported == "own" else reported
            senders = AbortSenders(network, {NAME: "anna"}.get)
            return senders.named(NAME, f"FAILURE: got abort request from system {words}")

    assert asyncio.run(run()) == f"FAILURE: aborted by {shown}"


def test_other_texts_and_an_abort_of_nobody_known_stay_readable() -> None:
    async def run() -> list[str]:
        async with Network([Radio()]) as network:
            number = network.console.id
            senders = AbortSenders(network)
            own = f"got abort request from system 0x{number:04X} - {number} @ 0"
            return [senders.named(NAME, text) for text in ("leak", own, "got abort request from system x - 99999 @ 0")]

    assert asyncio.run(run()) == ["leak", "aborted by a user on this page", "aborted by x (0x1869F)"]
